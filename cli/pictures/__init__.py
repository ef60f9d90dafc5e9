"""Pictures of jobs, robots and comparisons, drawn without a screen."""
