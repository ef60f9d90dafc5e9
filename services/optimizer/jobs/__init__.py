"""The domain: jobs, their specs, iterations and documents"""
