"""Execution of jobs: decisions in the coordinator, effects in the runner"""
