"""Experiments with the model: drives side by side, and what its simplifications cost."""
