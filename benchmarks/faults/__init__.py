"""A fault campaign: a real deployment, faults at random moments, and the histories afterwards."""
