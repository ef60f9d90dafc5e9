"""A robot in MuJoCo: its export, and walks by another engine."""
