"""Construction of the files of a release: wheel, Debian package, and lists of their components."""
