"""Metrics, activity and notifications of a process"""
