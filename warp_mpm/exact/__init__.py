"""Exact solutions, each headed by its problem statement, equations and reference."""
