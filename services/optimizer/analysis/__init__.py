"""Analyses of whole job histories"""
