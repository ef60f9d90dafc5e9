"""Views: domain objects as JSON, for the HTTP API and for `--json` on the command line."""
