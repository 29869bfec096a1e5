"""Pressed balloons, computed by a finite-element program that shares no equation with the estimators."""
