"""Writes Python from the description of the REST interface."""
