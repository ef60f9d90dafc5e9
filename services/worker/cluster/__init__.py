"""Nodes of a Ray cluster, what they are told, and how runners share them."""
