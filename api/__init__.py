"""REST under /v1, and the page: how programs ask."""
