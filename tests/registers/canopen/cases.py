"""What a CANopen master may send to node 5, and what must come back: rows for any slave with our dictionary.

A step is what is sent and what comes, in hex: identifier, then data. A request to 605h is filled up with
zeros to 8 bytes, unless it ends with "!". Of an answer the bytes that are given must match, the rest must be
0; "…" is any rest, "" silence. "+0.5 705" lets half a second pass and looks at 705h alone; "faults 3 4"
makes these the faults of the rig.
"""

PRE, OPERATIONAL, STOPPED = "pre", "operational", "stopped"

_SLOW_READ = ("605 40 08 10 00", "585 41 08 10 00 16")  # 22 characters, so in segments
_WATCH = ("605 23 16 10 01 F4 01 7F 00", "585 60 16 10 01")  # node 127, 500 ms

#: Requests whose answers do not depend on the rig; they are played to a live instrument too.
STANDING = [
    # ---- reading
    ("device type", PRE, [("605 40 00 10 00", "585 43 00 10 00 94 01 02 00")]),
    ("SYNC identifier", PRE, [("605 40 05 10 00", "585 43 05 10 00 80")]),
    ("four characters at once", PRE, [("605 40 09 10 00", "585 43 09 10 00 50 46 2D 31")]),
    ("text in segments", PRE, [
        _SLOW_READ,
        ("605 60", "585 00 70 6E 65 75 6D 61 74"),
        ("605 70", "585 10 69 63 20 66 6F 72 63"),
        ("605 60", "585 00 65 20 73 65 6E 73 6F"),
        ("605 70", "585 1D 72"),
    ]),
    ("emergency identifier", PRE, [("605 40 14 10 00", "585 43 14 10 00 85")]),
    ("emergency inhibit time", PRE, [("605 40 15 10 00", "585 4B 15 10 00")]),
    ("nobody is watched", PRE, [("605 40 16 10 01", "585 43 16 10 01")]),
    ("heartbeat each second", PRE, [("605 40 17 10 00", "585 4B 17 10 00 E8 03")]),
    ("identity has four", PRE, [("605 40 18 10 00", "585 4F 18 10 00 04")]),
    ("no vendor id", PRE, [("605 40 18 10 01", "585 43 18 10 01")]),
    ("product code", PRE, [("605 40 18 10 02", "585 43 18 10 02 01 00 46 50")]),
    ("revision", PRE, [("605 40 18 10 03", "585 43 18 10 03 00 00 01 00")]),
    ("error behaviour", PRE, [("605 40 29 10 01", "585 4F 29 10 01")]),
    ("SDO request identifier", PRE, [("605 40 00 12 01", "585 43 00 12 01 05 06")]),
    ("SDO answer identifier", PRE, [("605 40 00 12 02", "585 43 00 12 02 85 05")]),
    ("RPDO 1", PRE, [("605 40 00 14 01", "585 43 00 14 01 05 02")]),
    ("TPDO 1, no remote frame", PRE, [("605 40 00 18 01", "585 43 00 18 01 85 01 00 40")]),
    ("TPDO 4, no remote frame", PRE, [("605 40 03 18 01", "585 43 03 18 01 85 04 00 40")]),
    ("TPDO 3 inhibit time", PRE, [("605 40 02 18 03", "585 4B 02 18 03 64")]),
    ("TPDO 2 event timer", PRE, [("605 40 01 18 05", "585 4B 01 18 05 64")]),
    ("TPDO 1 maps five", PRE, [("605 40 00 1A 00", "585 4F 00 1A 00 05")]),
    ("TPDO 1 begins with force", PRE, [("605 40 00 1A 01", "585 43 00 1A 01 10 01 00 28")]),
    ("RPDO 1 ends with reserved", PRE, [("605 40 00 16 05", "585 43 00 16 05 10 05 10 28")]),
    ("test float", PRE, [("605 40 00 2F 00", "585 43 00 2F 00 66 E6 F6 C2")]),
    ("test long", PRE, [("605 40 02 2F 00", "585 43 02 2F 00 78 56 34 12")]),
    ("test integer", PRE, [("605 40 04 2F 00", "585 4B 04 2F 00 C7 CF")]),
    ("newton", PRE, [("605 40 31 61 01", "585 43 31 61 01 00 00 21 00")]),
    ("kilopascal", PRE, [("605 40 31 61 02", "585 43 31 61 02 00 00 22 03")]),
    ("read in operational", OPERATIONAL, [("605 40 00 10 00", "585 43 00 10 00 94 01 02 00")]),
    # ---- what is not there
    ("no object", PRE, [("605 40 34 12 00", "585 80 34 12 00 00 00 02 06")]),
    ("a reserved register", PRE, [("605 40 24 20 00", "585 80 24 20 00 00 00 02 06")]),
    ("no sub-index of a variable", PRE, [("605 40 00 10 01", "585 80 00 10 01 11 00 09 06")]),
    ("no sub-index of a record", PRE, [("605 40 18 10 05", "585 80 18 10 05 11 00 09 06")]),
    ("reserved sub-index 4 of a TPDO", PRE, [("605 40 00 18 04", "585 80 00 18 04 11 00 09 06")]),
    ("write to no object", PRE, [("605 2F 34 12 00 01", "585 80 34 12 00 00 00 02 06")]),
    # ---- writing what cannot be written
    ("device type is constant", PRE, [("605 23 00 10 00 01", "585 80 00 10 00 02 00 01 06")]),
    ("force is measured", PRE, [("605 23 00 20 00 00 00 80 3F", "585 80 00 20 00 02 00 01 06")]),
    ("mapping is fixed: number", PRE, [("605 2F 00 1A 00 00", "585 80 00 1A 00 02 00 01 06")]),
    ("mapping is fixed: object", PRE, [("605 23 00 1A 01 00", "585 80 00 1A 01 02 00 01 06")]),
    ("RPDO mapping is fixed", PRE, [("605 2F 00 16 00 00", "585 80 00 16 00 02 00 01 06")]),
    ("a read-only text, in segments", PRE, [("605 21 08 10 00 09", "585 80 08 10 00 02 00 01 06")]),
    ("a Command is no SDO", PRE, [("605 2F 10 28 02 01", "585 80 10 28 02 20 00 00 08")]),
    # ---- lengths
    ("mode in one byte", PRE, [("605 2F 04 22 00 00", "585 80 04 22 00 13 00 07 06")]),
    ("mode in four bytes", PRE, [("605 23 04 22 00 00", "585 80 04 22 00 12 00 07 06")]),
    ("mode, length left open", PRE, [("605 22 04 22 00 00", "585 60 04 22 00")]),
    ("half a setpoint", PRE, [("605 2B 00 22 00 00 41", "585 80 00 22 00 13 00 07 06")]),
    ("five bytes announced", PRE, [("605 21 00 22 00 05", "585 80 00 22 00 12 00 07 06")]),
    ("three bytes announced", PRE, [("605 21 00 22 00 03", "585 80 00 22 00 13 00 07 06")]),
    # ---- limits
    ("setpoint 12.5 kPa", PRE, [("605 23 00 22 00 00 00 48 41", "585 80 00 22 00 31 00 09 06")]),
    ("setpoint 1.5 kPa", PRE, [("605 23 00 22 00 00 00 C0 3F", "585 80 00 22 00 32 00 09 06")]),
    ("setpoint NaN", PRE, [("605 23 00 22 00 00 00 C0 7F", "585 80 00 22 00 30 00 09 06")]),
    ("setpoint infinite", PRE, [("605 23 00 22 00 00 00 80 7F", "585 80 00 22 00 30 00 09 06")]),
    ("setpoint 1999 Pa", PRE, [("605 2B 20 22 00 CF 07", "585 80 20 22 00 32 00 09 06")]),
    ("setpoint 12001 Pa", PRE, [("605 2B 20 22 00 E1 2E", "585 80 20 22 00 31 00 09 06")]),
    ("force limit 0.05 N", PRE, [("605 23 02 22 00 CD CC 4C 3D", "585 80 02 22 00 32 00 09 06")]),
    ("mode 2", PRE, [("605 2B 04 22 00 02", "585 80 04 22 00 31 00 09 06")]),
    ("lease 100 ms", PRE, [("605 2B 05 22 00 64", "585 80 05 22 00 30 00 09 06")]),
    ("lease 60001 ms", PRE, [("605 2B 05 22 00 61 EA", "585 80 05 22 00 31 00 09 06")]),
    ("wrong key", PRE, [("605 2B 08 22 00 47 50", "585 80 08 22 00 31 00 09 06")]),
    ("unknown command", PRE, [("605 2B 09 22 00 06", "585 80 09 22 00 31 00 09 06")]),
    ("error list set to 1", PRE, [("605 2F 03 10 00 01", "585 80 03 10 00 30 00 09 06")]),
    ("transmission type 241", PRE, [("605 2F 00 18 02 F1", "585 80 00 18 02 30 00 09 06")]),
    ("transmission type 253", PRE, [("605 2F 00 18 02 FD", "585 80 00 18 02 30 00 09 06")]),
    ("a Command at SYNC", PRE, [("605 2F 00 14 02 01", "585 80 00 14 02 30 00 09 06")]),
    ("another identifier", PRE, [("605 23 00 18 01 86 01 00 40", "585 80 00 18 01 30 00 09 06")]),
    ("remote frames allowed", PRE, [("605 23 00 18 01 85 01 00 00", "585 80 00 18 01 30 00 09 06")]),
    ("a watch over ourselves", PRE, [("605 23 16 10 01 F4 01 05 00", "585 80 16 10 01 30 00 09 06")]),
    ("a watch over node 128", PRE, [("605 23 16 10 01 F4 01 80 00", "585 80 16 10 01 30 00 09 06")]),
    ("error behaviour 3", PRE, [("605 2F 29 10 01 03", "585 80 29 10 01 31 00 09 06")]),
    # ---- writing
    ("heartbeat time", PRE, [
        ("605 2B 17 10 00 F4 01", "585 60 17 10 00"),
        ("605 40 17 10 00", "585 4B 17 10 00 F4 01"),
    ]),
    ("TPDO off and on", PRE, [
        ("605 23 00 18 01 85 01 00 C0", "585 60 00 18 01"),
        ("605 40 00 18 01", "585 43 00 18 01 85 01 00 C0"),
        ("605 23 00 18 01 85 01 00 40", "585 60 00 18 01"),
    ]),
    ("an inhibit time while its TPDO is there", PRE, [
        ("605 2B 00 18 03 64 00", "585 80 00 18 03 30 00 09 06"),
        ("605 40 00 18 03", "585 4B 00 18 03"),
        ("605 2B 02 18 03 64 00", "585 60 02 18 03"),  # as it is
    ]),
    ("an inhibit time while its TPDO is off", PRE, [
        ("605 23 00 18 01 85 01 00 C0", "585 60 00 18 01"),
        ("605 2B 00 18 03 64 00", "585 60 00 18 03"),
        ("605 40 00 18 03", "585 4B 00 18 03 64"),
        ("605 23 00 18 01 85 01 00 40", "585 60 00 18 01"),
    ]),
    ("types", PRE, [(f"605 2F 01 18 02 {code:02X}", "585 60 01 18 02") for code in (0, 1, 240, 254, 255)]),
    ("setpoint in one segment", PRE, [
        ("605 21 00 22 00 04", "585 60 00 22 00"),
        ("605 07 00 00 00 41", "585 20"),
        ("605 40 00 22 00", "585 43 00 22 00 00 00 00 41"),
    ]),
    ("setpoint in two segments", PRE, [
        ("605 21 00 22 00 04", "585 60 00 22 00"),
        ("605 0A 00 00", "585 20"),
        ("605 1B 00 41", "585 30"),
    ]),
    ("a watch over the master, and none", PRE, [
        _WATCH,
        ("605 23 16 10 01", "585 60 16 10 01"),
    ]),
    ("clearing the error list", PRE, [("605 2F 03 10 00 00", "585 60 03 10 00")]),
    # ---- dialogues that go wrong
    ("segment of nothing, up", PRE, [("605 60", "585 80 00 00 00 01 00 04 05")]),
    ("segment of nothing, down", PRE, [("605 00", "585 80 00 00 00 01 00 04 05")]),
    ("unknown specifier", PRE, [("605 E0 00 10 00", "585 80 00 10 00 01 00 04 05")]),
    ("block upload", PRE, [("605 A0 00 10 00", "585 80 00 10 00 01 00 04 05")]),
    ("block download", PRE, [("605 C0 00 22 00", "585 80 00 22 00 01 00 04 05")]),
    ("toggle of an upload", PRE, [_SLOW_READ, ("605 70", "585 80 08 10 00 00 00 03 05")]),
    ("toggle of a download", PRE, [
        ("605 21 00 22 00 04", "585 60 00 22 00"),
        ("605 17 00 00 00 41", "585 80 00 22 00 00 00 03 05"),
    ]),
    ("a segment twice", PRE, [
        _SLOW_READ,
        ("605 60", "585 00 …"),
        ("605 60", "585 80 08 10 00 00 00 03 05"),
    ]),
    ("segment in the other direction", PRE, [_SLOW_READ, ("605 00", "585 80 08 10 00 01 00 04 05")]),
    ("too much in segments", PRE, [
        ("605 20 00 22 00", "585 60 00 22 00"),
        ("605 05 01 02 03 04 05", "585 80 00 22 00 12 00 07 06"),
    ]),
    ("too little in segments", PRE, [
        ("605 20 00 22 00", "585 60 00 22 00"),
        ("605 0B 01 02", "585 80 00 22 00 13 00 07 06"),
    ]),
    ("the client's abort", PRE, [
        _SLOW_READ,
        ("605 80 08 10 00 00 00 00 08", ""),
        ("605 60", "585 80 00 00 00 01 00 04 05"),
    ]),
    ("a new transfer ends the old", PRE, [
        _SLOW_READ,
        ("605 40 05 10 00", "585 43 05 10 00 80"),
        ("605 60", "585 80 00 00 00 01 00 04 05"),
    ]),
    ("a write ends a transfer", PRE, [
        _SLOW_READ,
        ("605 2B 17 10 00 F4 01", "585 60 17 10 00"),
        ("605 60", "585 80 00 00 00 01 00 04 05"),
    ]),
    ("segments without end", PRE, [
        ("605 20 00 22 00", "585 60 00 22 00"),
        ("605 06 01 02 03 04", "585 20"),
        ("605 1C 05", "585 80 00 22 00 12 00 07 06"),
    ]),
    # ---- requests that are none
    ("four bytes", PRE, [("605 40 00 10 00 !", "")]),
    ("seven bytes", PRE, [("605 40 00 10 00 00 00 00 !", "")]),
    ("no bytes", PRE, [("605 !", "")]),
    ("another node", PRE, [("606 40 00 10 00 00 00 00 00", "")]),
    ("our own answer", PRE, [("585 40 00 10 00 00 00 00 00", "")]),
    ("stopped", STOPPED, [("605 40 00 10 00", "")]),
]  # fmt: skip

#: Requests whose answers need a rig and a time that the test decides.
MOVING = [
    ("force", PRE, [("605 40 00 20 00", "585 43 00 20 00 00 00 80 3F")]),
    ("force in mN", PRE, [("605 40 40 20 00", "585 4B 40 20 00 E8 03")]),
    ("force of the record", PRE, [("605 40 00 28 01", "585 4B 00 28 01 E8 03")]),
    ("force of the measuring device", PRE, [("605 40 30 61 01", "585 43 30 61 01 00 00 80 3F")]),
    ("force as an integer", PRE, [("605 40 30 71 01", "585 4B 30 71 01 E8 03")]),
    ("pressure not available", PRE, [("605 40 30 71 02", "585 4B 30 71 02 FF 7F")]),
    ("force is valid", PRE, [("605 40 50 61 01", "585 4F 50 61 01")]),
    ("pressure is not valid", PRE, [("605 40 50 61 02", "585 4F 50 61 02 01")]),
    ("a transfer given up", PRE, [
        _SLOW_READ,
        ("+1.9 585", ""),
        ("+0.2 585", "585 80 08 10 00 00 00 04 05"),
        ("605 60", "585 80 00 00 00 01 00 04 05"),
    ]),
    ("a transfer given up, and the node stopped", PRE, [_SLOW_READ, ("000 02 05", ""), ("+3 585", "")]),
    ("a text that was read to its end is not given up", PRE, [
        _SLOW_READ, ("605 60", "585 00 …"), ("605 70", "585 10 …"), ("605 60", "585 00 …"),
        ("605 70", "585 1D 72"), ("+3 585", ""),
    ]),
    ("each segment has its time", PRE, [
        _SLOW_READ, ("+1.9 585", ""), ("605 60", "585 00 …"), ("+1.9 585", ""),
    ]),
    # ---- network management
    ("heartbeat before the start", PRE, [("+1.05 705", "705 7F")]),
    ("start", PRE, [("000 01 05", ""), ("+1.05 705", "705 05")]),
    ("start of all", PRE, [("000 01 00", ""), ("+1.05 705", "705 05")]),
    ("start of another", PRE, [("000 01 06", ""), ("+1.05 705", "705 7F")]),
    ("start again", OPERATIONAL, [("000 01 05", ""), ("+1.05 705", "705 05")]),
    ("stop", OPERATIONAL, [("000 02 05", ""), ("+1.05 705", "705 04")]),
    ("stop before the start", PRE, [("000 02 05", ""), ("+1.05 705", "705 04")]),
    ("start from stop", STOPPED, [("000 01 05", ""), ("+1.05 705", "705 05")]),
    ("back to pre-operational", OPERATIONAL, [("000 80 05", ""), ("+1.05 705", "705 7F")]),
    ("from stop to pre-operational", STOPPED, [("000 80 05", ""), ("+1.05 705", "705 7F")]),
    ("reset of the node", OPERATIONAL, [("000 81 05", "705 00"), ("+1.05 705", "705 7F")]),
    ("reset of communication", STOPPED, [("000 82 05", "705 00"), ("+1.05 705", "705 7F")]),
    ("reset of all", PRE, [("000 82 00", "705 00")]),
    ("unknown NMT command", PRE, [("000 03 05", ""), ("+1.05 705", "705 7F")]),
    ("NMT command of one byte", PRE, [("000 01", ""), ("+1.05 705", "705 7F")]),
    ("NMT command of three bytes", PRE, [("000 01 05 00", ""), ("+1.05 705", "705 7F")]),
    ("a reset brings the defaults back", PRE, [
        ("605 2B 17 10 00 64 00", "585 60 17 10 00"),
        ("000 82 05", "705 00"),
        ("605 40 17 10 00", "585 4B 17 10 00 E8 03"),
    ]),
    ("a reset ends a transfer", PRE, [
        _SLOW_READ,
        ("000 82 05", "705 00"),
        ("605 60", "585 80 00 00 00 01 00 04 05"),
    ]),
    ("a reset keeps the watch", PRE, [
        _WATCH,
        ("000 81 05", "705 00"),
        ("605 40 16 10 01", "585 43 16 10 01 F4 01 7F 00"),
    ]),
    # ---- heartbeat
    ("heartbeat twice as fast", PRE, [
        ("605 2B 17 10 00 F4 01", "585 60 17 10 00"),
        ("+1.05 705", "705 7F | 705 7F"),
    ]),
    ("no heartbeat", PRE, [("605 2B 17 10 00 00 00", "585 60 17 10 00"), ("+3 705", "")]),
    ("a master that was never heard is not lost", PRE, [_WATCH, ("+2 085", "")]),
    ("a master that goes on is not lost", PRE, [
        _WATCH, ("77F 05", ""), ("+0.4 085", ""), ("77F 05", ""), ("+0.4 085", ""),
    ]),
    ("a lost master", PRE, [
        _WATCH,
        ("77F 05", ""),
        ("+0.6 085", "085 30 81 11 …"),
        ("+5 085", ""),
        ("605 40 01 10 00", "585 4F 01 10 00 11"),
        ("605 40 03 10 01", "585 43 03 10 01 30 81"),
    ]),
    ("a master that comes back", PRE, [
        _WATCH,
        ("77F 05", ""),
        ("+0.6 085", "085 30 81 11 …"),
        ("77F 05", ""),
        ("+0.1 085", "085 00 00 00 …"),
        ("+0.6 085", "085 30 81 11 …"),
    ]),
    ("a master that starts over and over is lost", PRE, [
        _WATCH, ("77F 05", ""), ("+0.4 085", ""), ("77F 00", ""), ("+0.2 085", "085 30 81 11 …"),
    ]),
    ("a boot-up does not bring a lost master back", PRE, [
        _WATCH, ("77F 05", ""), ("+0.6 085", "085 30 81 11 …"), ("77F 00", ""), ("+0.6 085", ""),
    ]),
    ("a boot-up does not begin the watch", PRE, [_WATCH, ("77F 00", ""), ("+2 085", "")]),
    ("a lost master that is watched no more", PRE, [
        _WATCH, ("77F 05", ""), ("+0.6 085", "085 30 81 11 …"),
        ("605 23 16 10 01", "585 60 16 10 01"),
        ("+0.02 085", "085 00 00 00 …"), ("605 40 01 10 00", "585 4F 01 10 00"),
    ]),
    ("another node's heartbeat", PRE, [_WATCH, ("77E 05", ""), ("+2 085", "")]),
    ("a long heartbeat is none", PRE, [_WATCH, ("77F 05 05", ""), ("+2 085", "")]),
    ("operational without a master", OPERATIONAL, [
        _WATCH, ("77F 05", ""), ("+0.6 085", "085 30 81 11 …"), ("+1.05 705", "705 7F"),
    ]),
    ("operational without a master, no change", OPERATIONAL, [
        ("605 2F 29 10 01 01", "585 60 29 10 01"),
        _WATCH, ("77F 05", ""), ("+0.6 085", "085 30 81 11 …"), ("+1.05 705", "705 05"),
    ]),
    ("stopped without a master", OPERATIONAL, [
        ("605 2F 29 10 01 02", "585 60 29 10 01"),
        _WATCH, ("77F 05", ""), ("+0.6 085", ""), ("+1.05 705", "705 04"),
    ]),
    ("stopped before the master was lost", PRE, [
        _WATCH, ("77F 05", ""), ("000 02 05", ""), ("+0.6 085", ""), ("+1.05 705", "705 04"),
    ]),
    ("lost, though the node was reset", PRE, [
        _WATCH, ("77F 05", ""), ("000 81 05", "705 00"), ("+0.6 085", "085 30 81 11 …"),
    ]),
    # ---- emergency
    ("a fault comes", PRE, [
        ("faults 3", ""),
        ("+0.02 085", "085 03 FF 81 01 …"),
        ("605 40 01 10 00", "585 4F 01 10 00 81"),
    ]),
    ("a fault goes", PRE, [
        ("faults 3", ""), ("+0.02 085", "085 03 FF 81 01 …"),
        ("faults", ""), ("+0.02 085", "085 00 00 00 …"),
        ("605 40 01 10 00", "585 4F 01 10 00"),
    ]),
    ("one fault goes, one stays", OPERATIONAL, [
        ("faults 3 4", ""), ("+0.02 085", "085 03 FF 81 02 … | 085 04 FF 81 02 …"),
        ("faults 4", ""), ("+0.02 085", "085 00 00 81 01 …"),
    ]),
    ("the newest error first", PRE, [
        ("faults 3", ""), ("+0.02 085", "085 03 FF …"), ("faults 3 4", ""), ("+0.02 085", "085 04 FF …"),
        ("605 40 03 10 00", "585 4F 03 10 00 02"),
        ("605 40 03 10 01", "585 43 03 10 01 04 FF"),
        ("605 40 03 10 02", "585 43 03 10 02 03 FF"),
        ("605 40 03 10 03", "585 80 03 10 03 24 00 00 08"),
        ("605 2F 03 10 00 00", "585 60 03 10 00"),
        ("605 40 03 10 01", "585 80 03 10 01 24 00 00 08"),
        ("605 40 01 10 00", "585 4F 01 10 00 81"),
    ]),
    ("an emergency waits while stopped", STOPPED, [
        ("faults 3", ""), ("+0.1 085", ""), ("000 80 05", ""), ("+0.02 085", "085 03 FF 81 …"),
    ]),
    ("emergencies apart", PRE, [
        ("605 2B 15 10 00 E8 03", "585 60 15 10 00"),  # 100 ms
        ("faults 3 4", ""), ("+0.05 085", "085 03 FF …"), ("+0.1 085", "085 04 FF …"),
    ]),
    ("after a reset a fault is told again", PRE, [
        ("faults 3", ""), ("+0.02 085", "085 03 FF …"), ("000 81 05", "705 00"), ("+0.02 085", "085 03 FF …"),
    ]),
    # ---- SYNC
    ("at each SYNC", PRE, [
        ("605 2F 01 18 02 01", "585 60 01 18 02"), ("000 01 05", ""), ("+1 285", ""),
        ("080", "285 40 1F …"), ("080 07", "285 40 1F …"), ("080 07 07", ""),
    ]),
    ("at each third SYNC", PRE, [
        ("605 2F 01 18 02 03", "585 60 01 18 02"), ("000 01 05", ""),
        ("080", ""), ("080", ""), ("080", "285 40 1F …"), ("080", ""),
    ]),
    ("a new start counts the SYNCs anew", PRE, [
        ("605 2F 01 18 02 03", "585 60 01 18 02"), ("000 01 05", ""), ("080", ""), ("080", ""),
        ("000 80 05", ""), ("000 01 05", ""), ("080", ""), ("080", ""), ("080", "285 40 1F …"),
    ]),
    ("no SYNC before the start", PRE, [("605 2F 01 18 02 01", "585 60 01 18 02"), ("080", "")]),
    ("no SYNC while stopped", PRE, [
        ("605 2F 01 18 02 01", "585 60 01 18 02"), ("000 02 05", ""), ("080", ""),
    ]),
    ("a TPDO that is off keeps silent at SYNC", PRE, [
        ("605 2F 01 18 02 01", "585 60 01 18 02"), ("605 23 01 18 01 85 02 00 C0", "585 60 01 18 01"),
        ("000 01 05", ""), ("080", ""),
    ]),
    ("an Answer at the SYNC after its Command", PRE, [
        ("605 2F 03 18 02 00", "585 60 03 18 02"), ("000 01 05", ""), ("+0.02 485", ""),
        ("205 40 1F 01 01 00 00 00 00", ""), ("080", "485 01 00 40 1F"), ("080", ""),
    ]),
    # ---- PDO
    ("a start again is no start", OPERATIONAL, [("+0.06 285", ""), ("000 01 05", ""), ("+0.02 285", "")]),
    ("a new start tells State at once", OPERATIONAL, [
        ("+0.06 285", ""), ("000 80 05", ""), ("000 01 05", ""), ("+0.01 285", "285 40 1F …"),
    ]),
    ("no PDO before the start", PRE, [("+1 285", ""), ("+1 185", ""), ("+1 385", "")]),
    ("no PDO while stopped", STOPPED, [("+1 285", "")]),
    ("a Command is answered", OPERATIONAL, [("205 40 1F 01 01 00 00 00 00", "485 01 00 40 1F")]),
    ("a Command again", OPERATIONAL, [
        ("205 40 1F 01 01 00 00 00 00", "485 01 00 40 1F"),
        ("205 40 1F 01 01 00 00 00 00", "485 01 04 40 1F"),
    ]),
    ("a Command before the start", PRE, [("205 40 1F 01 01 00 00 00 00", "")]),
    ("a Command while stopped", STOPPED, [("205 40 1F 01 01 00 00 00 00", "")]),
    ("a short Command", OPERATIONAL, [("205 40 1F 01 07", "485 07 01 40 1F")]),
    ("a Command out of span", OPERATIONAL, [("205 01 00 01 02 00 00 00 00", "485 02 02 40 1F")]),
    ("a Command to an RPDO that is off", OPERATIONAL, [
        ("605 23 00 14 01 05 02 00 80", "585 60 00 14 01"), ("205 40 1F 01 01 00 00 00 00", ""),
    ]),
    ("what was commanded is read back", OPERATIONAL, [
        ("205 40 1F 01 09 00 00 00 00", "485 09 00 40 1F"),
        ("605 40 10 28 01", "585 4B 10 28 01 40 1F"),
        ("605 40 10 28 03", "585 4F 10 28 03 09"),
        ("605 40 03 28 01", "585 4F 03 28 01 09"),
    ]),
    ("a short Command is not read back", OPERATIONAL, [
        ("205 40 1F 01 07", "485 07 01 40 1F"), ("605 40 10 28 03", "585 4F 10 28 03"),
    ]),
    ("a vent of the record passes by SDO", PRE, [("605 2F 10 28 02 00", "585 60 10 28 02")]),
]  # fmt: skip
