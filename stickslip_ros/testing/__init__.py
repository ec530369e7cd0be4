"""Helpers for people who test their own controllers: an operator, and whole runs over topics."""
