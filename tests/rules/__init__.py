"""Exhaustive search: do the rules of docs/rules.md hold after every sequence of events?"""
