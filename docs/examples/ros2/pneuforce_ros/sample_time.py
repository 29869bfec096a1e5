"""Time stamp of a sample. Needs no ROS."""

SAMPLE_PERIOD_NS = 2_000_000  #: the instrument measures 500 samples per second
MAX_JITTER_NS = 100_000_000  #: a time stamp that goes back by more follows a step of the clock


def sample_time_ns(now_ns: int, age_s: float, last_ns: int) -> int:
    """Return the time of a sample that has this age. `last_ns` is the time of the sample before.

    The times always increase, although the age is rounded to 1 ms and a busy computer reads `now_ns` late.
    """
    time_ns = now_ns - min(round(age_s * 1e9), now_ns)  # simulated time starts at 0
    if last_ns - time_ns < MAX_JITTER_NS:
        return max(time_ns, last_ns + SAMPLE_PERIOD_NS)
    return time_ns
