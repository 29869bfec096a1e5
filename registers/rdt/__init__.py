"""RDT server: force records over UDP for clients that are written for ATI Net F/T and Axia sensors."""
