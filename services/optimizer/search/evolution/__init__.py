"""Evolutionary methods: populations that vary and select."""
