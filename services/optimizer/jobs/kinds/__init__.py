"""Kinds of jobs, with their variables, cases and fitness"""
