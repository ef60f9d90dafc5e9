"""Kinds of jobs: what each varies, runs and minimizes."""
