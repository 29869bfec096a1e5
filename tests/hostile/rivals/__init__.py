"""The servers of others, played the same cases: what they are and how they are started."""
