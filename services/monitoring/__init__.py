"""Metrics, traces, activity and notifications of a process"""
