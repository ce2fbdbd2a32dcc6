"""Elastic constants of silicones: a table with sources, and Young's modulus from Shore hardness."""
