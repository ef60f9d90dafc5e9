"""Races of search methods: plans as data, runs kept as CSV files, tables of the documents."""
