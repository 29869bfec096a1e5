"""MQTT with Sparkplug B: a process that publishes the values of an instrument, and accepts a vent."""
