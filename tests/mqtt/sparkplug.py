"""Messages of Sparkplug B in the form that the tests compare."""

from pneuforce.mqtt.schema import PayloadMessage


def decoded(payload):
    """Return a payload with its metrics by name; the value of a null is None."""
    message = PayloadMessage.FromString(payload)
    return message, {metric.name: value_of(metric) for metric in message.metrics}


def value_of(metric):
    return None if metric.is_null else getattr(metric, metric.WhichOneof("value"))


def summary(messages):
    """Return the type of each message, with its sequence number."""
    return [(m.topic.split("/")[2], PayloadMessage.FromString(m.payload).seq) for m in messages]
