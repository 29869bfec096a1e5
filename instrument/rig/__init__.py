"""Host side of the rig link: protocol, clock of the board, age of the samples, USB device."""
