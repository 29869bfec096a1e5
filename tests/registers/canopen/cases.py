"""Table of requests from a CANopen master to node 5 and the expected responses.

A case is a name, the NMT state at its start, and a list of steps. A step is a pair of texts: the frame sent,
and the expected frames, separated by "|". A frame is its identifier and its data, in hex.

- A frame with the identifier 605h is filled with zeros to 8 bytes, unless it ends with "!".
- The given bytes of a response must match. All further bytes must be 0, or can have any value after "…".
- "" means that no frame is expected.
- "+0.5 705" waits for half a second and looks only at frames with the identifier 705h.
- "faults 3 4" sets the faults of the rig.
"""

from pneuforce.registers.canopen.communication import revision_number
from pneuforce.registers.map_hash import MAP_HASH

PRE, OPERATIONAL, STOPPED = "pre", "operational", "stopped"

_SEGMENTED_UPLOAD = ("605 40 08 10 00", "585 41 08 10 00 16")  # a text of 22 characters is read in segments
_MONITOR_MASTER = ("605 23 16 10 01 F4 01 7F 00", "585 60 16 10 01")  # heartbeat deadline of node 127: 500 ms

_REVISION = revision_number(MAP_HASH).to_bytes(4, "little").hex(" ").upper()

#: Cases whose responses do not depend on the rig. They are also tested with a running instrument.
STATIC_CASES = [
    # ---- reads
    ("device type", PRE, [("605 40 00 10 00", "585 43 00 10 00 94 01 82 00")]),
    ("SYNC COB-ID", PRE, [("605 40 05 10 00", "585 43 05 10 00 80")]),
    ("text of four characters, expedited", PRE, [("605 40 09 10 00", "585 43 09 10 00 50 46 2D 31")]),
    ("text in segments", PRE, [
        _SEGMENTED_UPLOAD,
        ("605 60", "585 00 70 6E 65 75 6D 61 74"),
        ("605 70", "585 10 69 63 20 66 6F 72 63"),
        ("605 60", "585 00 65 20 73 65 6E 73 6F"),
        ("605 70", "585 1D 72"),
    ]),
    ("emergency COB-ID", PRE, [("605 40 14 10 00", "585 43 14 10 00 85")]),
    ("emergency inhibit time", PRE, [("605 40 15 10 00", "585 4B 15 10 00")]),
    ("no master is monitored", PRE, [("605 40 16 10 01", "585 43 16 10 01")]),
    ("heartbeat every second", PRE, [("605 40 17 10 00", "585 4B 17 10 00 E8 03")]),
    ("identity has four entries", PRE, [("605 40 18 10 00", "585 4F 18 10 00 04")]),
    ("no vendor id", PRE, [("605 40 18 10 01", "585 43 18 10 01")]),
    ("product code", PRE, [("605 40 18 10 02", "585 43 18 10 02 01 00 46 50")]),
    ("revision", PRE, [("605 40 18 10 03", f"585 43 18 10 03 {_REVISION}")]),
    ("error behaviour", PRE, [("605 40 29 10 01", "585 4F 29 10 01")]),
    ("SDO request COB-ID", PRE, [("605 40 00 12 01", "585 43 00 12 01 05 06")]),
    ("SDO response COB-ID", PRE, [("605 40 00 12 02", "585 43 00 12 02 85 05")]),
    ("RPDO 1 COB-ID", PRE, [("605 40 00 14 01", "585 43 00 14 01 05 02")]),
    ("TPDO 1 COB-ID, no remote frames", PRE, [("605 40 00 18 01", "585 43 00 18 01 85 01 00 40")]),
    ("TPDO 4 COB-ID, no remote frames", PRE, [("605 40 03 18 01", "585 43 03 18 01 85 04 00 40")]),
    ("TPDO 3 inhibit time", PRE, [("605 40 02 18 03", "585 4B 02 18 03 64")]),
    ("TPDO 2 event timer", PRE, [("605 40 01 18 05", "585 4B 01 18 05 64")]),
    ("TPDO 1 maps five objects", PRE, [("605 40 00 1A 00", "585 4F 00 1A 00 05")]),
    ("TPDO 1 maps force first", PRE, [("605 40 00 1A 01", "585 43 00 1A 01 10 01 30 71")]),
    ("TPDO 1 maps pressure next", PRE, [("605 40 00 1A 02", "585 43 00 1A 02 10 02 30 71")]),
    ("TPDO 1 maps its own uncertainty", PRE, [("605 40 00 1A 03", "585 43 00 1A 03 10 03 00 28")]),
    ("RPDO 1 maps reserved last", PRE, [("605 40 00 16 05", "585 43 00 16 05 10 05 10 28")]),
    ("test float", PRE, [("605 40 00 2F 00", "585 43 00 2F 00 66 E6 F6 C2")]),
    ("test long", PRE, [("605 40 02 2F 00", "585 43 02 2F 00 78 56 34 12")]),
    ("test integer", PRE, [("605 40 04 2F 00", "585 4B 04 2F 00 C7 CF")]),
    ("unit newton", PRE, [("605 40 31 61 01", "585 43 31 61 01 00 00 21 00")]),
    ("unit kilopascal", PRE, [("605 40 31 61 02", "585 43 31 61 02 00 00 22 03")]),
    ("force is computed from a pressure", PRE, [("605 40 10 61 01", "585 4B 10 61 01 10 27")]),
    ("pressure sensor", PRE, [("605 40 10 61 02", "585 4B 10 61 02 5A")]),
    ("normal operation", PRE, [("605 40 12 61 02", "585 4F 12 61 02 01")]),
    ("a sample every 2000 us", PRE, [("605 40 14 61 02", "585 43 14 61 02 D0 07")]),
    ("force has no offset", PRE, [("605 40 24 61 01", "585 43 24 61 01")]),
    ("autozero for two channels", PRE, [("605 40 25 61 00", "585 4F 25 61 00 02")]),
    ("integers in thousandths", PRE, [("605 40 32 61 01", "585 4F 32 61 01 03")]),
    ("span from -20 N", PRE, [("605 40 48 61 01", "585 43 48 61 01 00 00 A0 C1")]),
    ("span to 20 N", PRE, [("605 40 49 61 01", "585 43 49 61 01 00 00 A0 41")]),
    ("span from -5 kPa", PRE, [("605 40 48 61 02", "585 43 48 61 02 00 00 A0 C0")]),
    ("span to 50 kPa", PRE, [("605 40 49 61 02", "585 43 49 61 02 00 00 48 42")]),
    ("force without a filter", PRE, [("605 40 A0 61 01", "585 4F A0 61 01")]),
    ("filter constant of the force", PRE, [("605 40 A1 61 01", "585 4B A1 61 01 01")]),
    ("pressure with a moving average", PRE, [("605 40 A0 61 02", "585 4F A0 61 02 01")]),
    ("autozero cannot be read", PRE, [("605 40 25 61 02", "585 80 25 61 02 01 00 01 06")]),
    ("read in operational", OPERATIONAL, [("605 40 00 10 00", "585 43 00 10 00 94 01 82 00")]),
    # ---- objects and sub-indexes that do not exist
    ("unknown object", PRE, [("605 40 34 12 00", "585 80 34 12 00 00 00 02 06")]),
    ("a reserved register", PRE, [("605 40 3C 20 00", "585 80 3C 20 00 00 00 02 06")]),
    ("unknown sub-index of a variable", PRE, [("605 40 00 10 01", "585 80 00 10 01 11 00 09 06")]),
    ("unknown sub-index of a record", PRE, [("605 40 18 10 05", "585 80 18 10 05 11 00 09 06")]),
    ("reserved sub-index 4 of a TPDO", PRE, [("605 40 00 18 04", "585 80 00 18 04 11 00 09 06")]),
    ("write to an unknown object", PRE, [("605 2F 34 12 00 01", "585 80 34 12 00 00 00 02 06")]),
    *(
        (f"object {index} is not supported", PRE, [
            (f"605 40 {index[2:4]} {index[:2]} 00", f"585 80 {index[2:4]} {index[:2]} 00 00 00 02 06"),
        ])
        for index in ("1006h", "1007h", "100Ch", "100Dh", "1012h", "1019h", "1020h", "1201h", "1280h")
    ),
    # ---- writes to read-only objects
    ("SYNC COB-ID is fixed", PRE, [("605 23 05 10 00 80 00 00 40", "585 80 05 10 00 02 00 01 06")]),
    ("emergency COB-ID is fixed", PRE, [("605 23 14 10 00 86", "585 80 14 10 00 02 00 01 06")]),
    ("SDO COB-ID is fixed", PRE, [("605 23 00 12 01 06 06", "585 80 00 12 01 02 00 01 06")]),
    ("device type is constant", PRE, [("605 23 00 10 00 01", "585 80 00 10 00 02 00 01 06")]),
    ("force is measured", PRE, [("605 23 00 20 00 00 00 80 3F", "585 80 00 20 00 02 00 01 06")]),
    ("mapping is fixed: number of objects", PRE, [("605 2F 00 1A 00 00", "585 80 00 1A 00 02 00 01 06")]),
    ("mapping is fixed: mapped object", PRE, [("605 23 00 1A 01 00", "585 80 00 1A 01 00 00 01 06")]),
    ("RPDO mapping is fixed", PRE, [("605 2F 00 16 00 00", "585 80 00 16 00 02 00 01 06")]),
    ("mapping is fixed: an object that does not exist", PRE, [
        ("605 23 00 1A 01 08 00 00 99", "585 80 00 1A 01 00 00 01 06"),
    ]),
    ("mapping is fixed: too many objects", PRE, [("605 2F 02 1A 00 40", "585 80 02 1A 00 02 00 01 06")]),
    ("read-only text, in segments", PRE, [("605 21 08 10 00 09", "585 80 08 10 00 02 00 01 06")]),
    ("a Command cannot be sent by SDO", PRE, [("605 2F 10 28 02 01", "585 80 10 28 02 20 00 00 08")]),
    ("span start is constant", PRE, [("605 23 48 61 01 00", "585 80 48 61 01 02 00 01 06")]),
    ("offset cannot be written", PRE, [("605 23 24 61 02 00", "585 80 24 61 02 02 00 01 06")]),
    ("filter cannot be changed", PRE, [("605 2F A0 61 02 00", "585 80 A0 61 02 02 00 01 06")]),
    ("autozero of the force", PRE, [("605 23 25 61 01 7A 65 72 6F", "585 80 25 61 01 20 00 00 08")]),
    ("autozero with a wrong signature", PRE, [
        ("605 23 25 61 02 6F 72 65 7A", "585 80 25 61 02 20 00 00 08"),
    ]),
    # ---- lengths
    ("autozero in two bytes", PRE, [("605 2B 25 61 02 7A 65", "585 80 25 61 02 13 00 07 06")]),
    ("mode in one byte", PRE, [("605 2F 04 22 00 00", "585 80 04 22 00 13 00 07 06")]),
    ("mode in four bytes", PRE, [("605 23 04 22 00 00", "585 80 04 22 00 12 00 07 06")]),
    ("mode without a length", PRE, [("605 22 04 22 00 00", "585 60 04 22 00")]),
    ("two of four bytes of a setpoint", PRE, [("605 2B 00 22 00 00 41", "585 80 00 22 00 13 00 07 06")]),
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
    ("unknown command", PRE, [("605 2B 09 22 00 07", "585 80 09 22 00 31 00 09 06")]),
    ("error history set to 1", PRE, [("605 2F 03 10 00 01", "585 80 03 10 00 30 00 09 06")]),
    ("transmission type 241", PRE, [("605 2F 00 18 02 F1", "585 80 00 18 02 30 00 09 06")]),
    ("transmission type 253", PRE, [("605 2F 00 18 02 FD", "585 80 00 18 02 30 00 09 06")]),
    ("synchronous RPDO", PRE, [("605 2F 00 14 02 01", "585 80 00 14 02 30 00 09 06")]),
    ("changed COB-ID", PRE, [("605 23 00 18 01 86 01 00 40", "585 80 00 18 01 30 00 09 06")]),
    ("remote frames allowed", PRE, [("605 23 00 18 01 85 01 00 00", "585 80 00 18 01 30 00 09 06")]),
    ("monitoring of this node itself", PRE, [("605 23 16 10 01 F4 01 05 00", "585 80 16 10 01 30 00 09 06")]),
    ("monitoring of node 128", PRE, [("605 23 16 10 01 F4 01 80 00", "585 80 16 10 01 30 00 09 06")]),
    ("error behaviour 3", PRE, [("605 2F 29 10 01 03", "585 80 29 10 01 31 00 09 06")]),
    # ---- writes
    ("heartbeat time", PRE, [
        ("605 2B 17 10 00 F4 01", "585 60 17 10 00"),
        ("605 40 17 10 00", "585 4B 17 10 00 F4 01"),
    ]),
    ("heartbeat time in one segment", PRE, [
        ("605 21 17 10 00 02", "585 60 17 10 00"),
        ("605 0B F4 01", "585 20"),
        ("605 40 17 10 00", "585 4B 17 10 00 F4 01"),
    ]),
    ("heartbeat time in one byte", PRE, [("605 2F 17 10 00 01", "585 80 17 10 00 13 00 07 06")]),
    ("TPDO disabled and enabled", PRE, [
        ("605 23 00 18 01 85 01 00 C0", "585 60 00 18 01"),
        ("605 40 00 18 01", "585 43 00 18 01 85 01 00 C0"),
        ("605 23 00 18 01 85 01 00 40", "585 60 00 18 01"),
    ]),
    ("inhibit time of an enabled TPDO", PRE, [
        ("605 2B 00 18 03 64 00", "585 80 00 18 03 30 00 09 06"),
        ("605 40 00 18 03", "585 4B 00 18 03"),
        ("605 2B 02 18 03 64 00", "585 60 02 18 03"),  # a write of the present value is accepted
    ]),
    ("inhibit time of a disabled TPDO", PRE, [
        ("605 23 00 18 01 85 01 00 C0", "585 60 00 18 01"),
        ("605 2B 00 18 03 64 00", "585 60 00 18 03"),
        ("605 40 00 18 03", "585 4B 00 18 03 64"),
        ("605 23 00 18 01 85 01 00 40", "585 60 00 18 01"),
    ]),
    ("transmission types", PRE, [
        (f"605 2F 01 18 02 {code:02X}", "585 60 01 18 02") for code in (0, 1, 240, 254, 255)
    ]),
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
    ("monitoring of the master, started and ended", PRE, [
        _MONITOR_MASTER,
        ("605 23 16 10 01", "585 60 16 10 01"),
    ]),
    ("error history cleared", PRE, [("605 2F 03 10 00 00", "585 60 03 10 00")]),
    # ---- protocol errors
    ("upload segment without a transfer", PRE, [("605 60", "585 80 00 00 00 01 00 04 05")]),
    ("download segment without a transfer", PRE, [("605 00", "585 80 00 00 00 01 00 04 05")]),
    ("unknown specifier", PRE, [("605 E0 00 10 00", "585 80 00 10 00 01 00 04 05")]),
    ("block upload", PRE, [("605 A0 00 10 00", "585 80 00 10 00 01 00 04 05")]),
    ("block download", PRE, [("605 C0 00 22 00", "585 80 00 22 00 01 00 04 05")]),
    ("wrong toggle bit in an upload", PRE, [_SEGMENTED_UPLOAD, ("605 70", "585 80 08 10 00 00 00 03 05")]),
    ("wrong toggle bit in a download", PRE, [
        ("605 21 00 22 00 04", "585 60 00 22 00"),
        ("605 17 00 00 00 41", "585 80 00 22 00 00 00 03 05"),
    ]),
    ("repeated segment", PRE, [
        _SEGMENTED_UPLOAD,
        ("605 60", "585 00 …"),
        ("605 60", "585 80 08 10 00 00 00 03 05"),
    ]),
    ("segment in the other direction", PRE, [_SEGMENTED_UPLOAD, ("605 00", "585 80 08 10 00 01 00 04 05")]),
    ("too many bytes in segments", PRE, [
        ("605 20 00 22 00", "585 60 00 22 00"),
        ("605 05 01 02 03 04 05", "585 80 00 22 00 12 00 07 06"),
    ]),
    ("too few bytes in segments", PRE, [
        ("605 20 00 22 00", "585 60 00 22 00"),
        ("605 0B 01 02", "585 80 00 22 00 13 00 07 06"),
    ]),
    ("abort by the client", PRE, [
        _SEGMENTED_UPLOAD,
        ("605 80 08 10 00 00 00 00 08", ""),
        ("605 60", "585 80 00 00 00 01 00 04 05"),
    ]),
    ("a read ends a transfer", PRE, [
        _SEGMENTED_UPLOAD,
        ("605 40 05 10 00", "585 43 05 10 00 80"),
        ("605 60", "585 80 00 00 00 01 00 04 05"),
    ]),
    ("a write ends a transfer", PRE, [
        _SEGMENTED_UPLOAD,
        ("605 2B 17 10 00 F4 01", "585 60 17 10 00"),
        ("605 60", "585 80 00 00 00 01 00 04 05"),
    ]),
    ("segments without a last one", PRE, [
        ("605 20 00 22 00", "585 60 00 22 00"),
        ("605 06 01 02 03 04", "585 20"),
        ("605 1C 05", "585 80 00 22 00 12 00 07 06"),
    ]),
    # ---- frames that are not SDO requests
    ("four bytes", PRE, [("605 40 00 10 00 !", "")]),
    ("seven bytes", PRE, [("605 40 00 10 00 00 00 00 !", "")]),
    ("no bytes", PRE, [("605 !", "")]),
    ("another node", PRE, [("606 40 00 10 00 00 00 00 00", "")]),
    ("SDO response identifier of this node", PRE, [("585 40 00 10 00 00 00 00 00", "")]),
    ("SDO request while stopped", STOPPED, [("605 40 00 10 00", "")]),
]  # fmt: skip

#: Cases whose responses depend on the rig or on time, so that the test must control both.
DYNAMIC_CASES = [
    ("force", PRE, [("605 40 00 20 00", "585 43 00 20 00 00 00 80 3F")]),
    ("force in mN", PRE, [("605 40 40 20 00", "585 4B 40 20 00 E8 03")]),
    ("force in the record", PRE, [("605 40 00 28 01", "585 4B 00 28 01 E8 03")]),
    ("force in the measuring device profile", PRE, [("605 40 30 61 01", "585 43 30 61 01 00 00 80 3F")]),
    ("force as an integer", PRE, [("605 40 30 71 01", "585 4B 30 71 01 E8 03")]),
    ("force as a long integer", PRE, [("605 40 30 91 01", "585 43 30 91 01 E8 03")]),
    ("pressure not available as a long integer", PRE, [
        ("605 40 30 91 02", "585 43 30 91 02 FF FF FF 7F"),
    ]),
    ("offset not available", PRE, [("605 40 24 61 02", "585 43 24 61 02 00 00 C0 7F")]),
    ("autozero", PRE, [("605 23 25 61 02 7A 65 72 6F", "585 60 25 61 02")]),
    ("autozero in operational, without a length", OPERATIONAL, [
        ("605 22 25 61 02 7A 65 72 6F", "585 60 25 61 02"),
    ]),
    ("pressure not available", PRE, [("605 40 30 71 02", "585 4B 30 71 02 FF 7F")]),
    ("force is valid", PRE, [("605 40 50 61 01", "585 4F 50 61 01")]),
    ("pressure is not valid", PRE, [("605 40 50 61 02", "585 4F 50 61 02 01")]),
    ("transfer without the next request", PRE, [
        _SEGMENTED_UPLOAD,
        ("+1.9 585", ""),
        ("+0.2 585", "585 80 08 10 00 00 00 04 05"),
        ("605 60", "585 80 00 00 00 01 00 04 05"),
    ]),
    ("transfer without the next request, node stopped", PRE, [
        _SEGMENTED_UPLOAD, ("000 02 05", ""), ("+3 585", ""),
    ]),
    ("no timeout after the last segment", PRE, [
        _SEGMENTED_UPLOAD, ("605 60", "585 00 …"), ("605 70", "585 10 …"), ("605 60", "585 00 …"),
        ("605 70", "585 1D 72"), ("+3 585", ""),
    ]),
    ("the timeout restarts with each segment", PRE, [
        _SEGMENTED_UPLOAD, ("+1.9 585", ""), ("605 60", "585 00 …"), ("+1.9 585", ""),
    ]),
    # ---- network management
    ("heartbeat before the start", PRE, [("+1.05 705", "705 7F")]),
    ("start", PRE, [("000 01 05", ""), ("+1.05 705", "705 05")]),
    ("start of all nodes", PRE, [("000 01 00", ""), ("+1.05 705", "705 05")]),
    ("start of another node", PRE, [("000 01 06", ""), ("+1.05 705", "705 7F")]),
    ("start while operational", OPERATIONAL, [("000 01 05", ""), ("+1.05 705", "705 05")]),
    ("stop", OPERATIONAL, [("000 02 05", ""), ("+1.05 705", "705 04")]),
    ("stop before the start", PRE, [("000 02 05", ""), ("+1.05 705", "705 04")]),
    ("start from stop", STOPPED, [("000 01 05", ""), ("+1.05 705", "705 05")]),
    ("back to pre-operational", OPERATIONAL, [("000 80 05", ""), ("+1.05 705", "705 7F")]),
    ("from stop to pre-operational", STOPPED, [("000 80 05", ""), ("+1.05 705", "705 7F")]),
    ("reset of the node", OPERATIONAL, [("000 81 05", "705 00"), ("+1.05 705", "705 7F")]),
    ("reset of communication", STOPPED, [("000 82 05", "705 00"), ("+1.05 705", "705 7F")]),
    ("reset of all nodes", PRE, [("000 82 00", "705 00")]),
    ("unknown NMT command", PRE, [("000 03 05", ""), ("+1.05 705", "705 7F")]),
    ("NMT command of one byte", PRE, [("000 01", ""), ("+1.05 705", "705 7F")]),
    ("NMT command of three bytes", PRE, [("000 01 05 00", ""), ("+1.05 705", "705 7F")]),
    ("a reset restores the defaults", PRE, [
        ("605 2B 17 10 00 64 00", "585 60 17 10 00"),
        ("000 82 05", "705 00"),
        ("605 40 17 10 00", "585 4B 17 10 00 E8 03"),
    ]),
    ("a reset ends a transfer", PRE, [
        _SEGMENTED_UPLOAD,
        ("000 82 05", "705 00"),
        ("605 60", "585 80 00 00 00 01 00 04 05"),
    ]),
    ("a reset restores the master to be monitored", PRE, [
        _MONITOR_MASTER,
        ("000 81 05", "705 00"),
        ("605 40 16 10 01", "585 43 16 10 01"),
        ("77F 05", ""), ("+0.6 085", ""),
    ]),
    ("a reset does not end a monitoring that has started", PRE, [
        _MONITOR_MASTER,
        ("77F 05", ""), ("000 82 05", "705 00"),
        ("77F 05", ""), ("+0.4 085", ""), ("+0.2 085", "085 30 81 11 …"),
        ("000 82 05", "705 00"), ("+0.02 085", "085 30 81 11 …"),
        ("77F 05", ""), ("+0.1 085", "085 00 00 00 …"),
    ]),
    ("a write to 1016h ends a monitoring that survived a reset", PRE, [
        _MONITOR_MASTER, ("77F 05", ""), ("000 82 05", "705 00"),
        ("605 23 16 10 01 F4 01 7E 00", "585 60 16 10 01"),
        ("+2 085", ""), ("77E 05", ""), ("+0.4 085", ""), ("77F 05", ""), ("+0.2 085", "085 30 81 11 …"),
    ]),
    # ---- heartbeat
    ("heartbeat twice as fast", PRE, [
        ("605 2B 17 10 00 F4 01", "585 60 17 10 00"),
        ("+1.05 705", "705 7F | 705 7F"),
    ]),
    ("no heartbeat", PRE, [("605 2B 17 10 00 00 00", "585 60 17 10 00"), ("+3 705", "")]),
    ("a master without a first heartbeat is not lost", PRE, [_MONITOR_MASTER, ("+2 085", "")]),
    ("a master that sends heartbeats is not lost", PRE, [
        _MONITOR_MASTER, ("77F 05", ""), ("+0.4 085", ""), ("77F 05", ""), ("+0.4 085", ""),
    ]),
    ("master lost", PRE, [
        _MONITOR_MASTER,
        ("77F 05", ""),
        ("+0.6 085", "085 30 81 11 …"),
        ("+5 085", ""),
        ("605 40 01 10 00", "585 4F 01 10 00 11"),
        ("605 40 03 10 01", "585 43 03 10 01 30 81"),
    ]),
    ("master recovered and lost again", PRE, [
        _MONITOR_MASTER,
        ("77F 05", ""),
        ("+0.6 085", "085 30 81 11 …"),
        ("77F 05", ""),
        ("+0.1 085", "085 00 00 00 …"),
        ("+0.6 085", "085 30 81 11 …"),
    ]),
    ("a master that only sends boot-up messages is lost", PRE, [
        _MONITOR_MASTER, ("77F 05", ""), ("+0.4 085", ""), ("77F 00", ""), ("+0.2 085", "085 30 81 11 …"),
    ]),
    ("a boot-up message does not recover a lost master", PRE, [
        _MONITOR_MASTER, ("77F 05", ""), ("+0.6 085", "085 30 81 11 …"), ("77F 00", ""), ("+0.6 085", ""),
    ]),
    ("a boot-up message does not start the monitoring", PRE, [
        _MONITOR_MASTER, ("77F 00", ""), ("+2 085", ""),
    ]),
    ("monitoring ended after the master was lost", PRE, [
        _MONITOR_MASTER, ("77F 05", ""), ("+0.6 085", "085 30 81 11 …"),
        ("605 23 16 10 01", "585 60 16 10 01"),
        ("+0.02 085", "085 00 00 00 …"), ("605 40 01 10 00", "585 4F 01 10 00"),
    ]),
    ("heartbeat of another node", PRE, [_MONITOR_MASTER, ("77E 05", ""), ("+2 085", "")]),
    ("heartbeat with two bytes", PRE, [_MONITOR_MASTER, ("77F 05 05", ""), ("+2 085", "")]),
    ("master lost, to pre-operational", OPERATIONAL, [
        _MONITOR_MASTER, ("77F 05", ""), ("+0.6 085", "085 30 81 11 …"), ("+1.05 705", "705 7F"),
    ]),
    ("master lost, no change of state", OPERATIONAL, [
        ("605 2F 29 10 01 01", "585 60 29 10 01"),
        _MONITOR_MASTER, ("77F 05", ""), ("+0.6 085", "085 30 81 11 …"), ("+1.05 705", "705 05"),
    ]),
    ("master lost, to stopped", OPERATIONAL, [
        ("605 2F 29 10 01 02", "585 60 29 10 01"),
        _MONITOR_MASTER, ("77F 05", ""), ("+0.6 085", ""), ("+1.05 705", "705 04"),
    ]),
    ("master lost while stopped", PRE, [
        _MONITOR_MASTER, ("77F 05", ""), ("000 02 05", ""), ("+0.6 085", ""), ("+1.05 705", "705 04"),
    ]),
    ("master lost after a reset of the node", PRE, [
        _MONITOR_MASTER, ("77F 05", ""), ("000 81 05", "705 00"), ("+0.6 085", "085 30 81 11 …"),
    ]),
    # ---- emergency
    ("new fault", PRE, [
        ("faults 3", ""),
        ("+0.02 085", "085 03 FF 81 01 …"),
        ("605 40 01 10 00", "585 4F 01 10 00 81"),
    ]),
    ("fault cleared", PRE, [
        ("faults 3", ""), ("+0.02 085", "085 03 FF 81 01 …"),
        ("faults", ""), ("+0.02 085", "085 00 00 00 …"),
        ("605 40 01 10 00", "585 4F 01 10 00"),
    ]),
    ("one of two faults cleared", OPERATIONAL, [
        ("faults 3 4", ""), ("+0.02 085", "085 03 FF 81 02 … | 085 04 FF 81 02 …"),
        ("faults 4", ""), ("+0.02 085", "085 00 00 81 01 …"),
    ]),
    ("error history, the newest first", PRE, [
        ("faults 3", ""), ("+0.02 085", "085 03 FF …"), ("faults 3 4", ""), ("+0.02 085", "085 04 FF …"),
        ("605 40 03 10 00", "585 4F 03 10 00 02"),
        ("605 40 03 10 01", "585 43 03 10 01 04 FF"),
        ("605 40 03 10 02", "585 43 03 10 02 03 FF"),
        ("605 40 03 10 03", "585 80 03 10 03 24 00 00 08"),
        ("605 2F 03 10 00 00", "585 60 03 10 00"),
        ("605 40 03 10 01", "585 80 03 10 01 24 00 00 08"),
        ("605 40 01 10 00", "585 4F 01 10 00 81"),
    ]),
    ("emergency is sent after stopped", STOPPED, [
        ("faults 3", ""), ("+0.1 085", ""), ("000 80 05", ""), ("+0.02 085", "085 03 FF 81 …"),
    ]),
    ("emergencies with an inhibit time", PRE, [
        ("605 2B 15 10 00 E8 03", "585 60 15 10 00"),  # inhibit time 100 ms
        ("faults 3 4", ""), ("+0.05 085", "085 03 FF …"), ("+0.1 085", "085 04 FF …"),
    ]),
    ("a fault is sent again after a reset", PRE, [
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
    ("a new start resets the SYNC count", PRE, [
        ("605 2F 01 18 02 03", "585 60 01 18 02"), ("000 01 05", ""), ("080", ""), ("080", ""),
        ("000 80 05", ""), ("000 01 05", ""), ("080", ""), ("080", ""), ("080", "285 40 1F …"),
    ]),
    ("SYNC before the start", PRE, [("605 2F 01 18 02 01", "585 60 01 18 02"), ("080", "")]),
    ("SYNC while stopped", PRE, [
        ("605 2F 01 18 02 01", "585 60 01 18 02"), ("000 02 05", ""), ("080", ""),
    ]),
    ("disabled TPDO at SYNC", PRE, [
        ("605 2F 01 18 02 01", "585 60 01 18 02"), ("605 23 01 18 01 85 02 00 C0", "585 60 01 18 01"),
        ("000 01 05", ""), ("080", ""),
    ]),
    ("Answer at the SYNC after its Command", PRE, [
        ("605 2F 03 18 02 00", "585 60 03 18 02"), ("000 01 05", ""), ("+0.02 485", ""),
        ("205 40 1F 01 01 00 00 00 00", ""), ("080", "485 01 00 40 1F"), ("080", ""),
    ]),
    # ---- PDO
    ("start while operational does not send PDOs", OPERATIONAL, [
        ("+0.06 285", ""), ("000 01 05", ""), ("+0.02 285", ""),
    ]),
    ("a new start sends State at once", OPERATIONAL, [
        ("+0.06 285", ""), ("000 80 05", ""), ("000 01 05", ""), ("+0.01 285", "285 40 1F …"),
    ]),
    ("no TPDO before the start", PRE, [("+1 285", ""), ("+1 185", ""), ("+1 385", "")]),
    ("no TPDO while stopped", STOPPED, [("+1 285", "")]),
    ("Command is answered", OPERATIONAL, [("205 40 1F 01 01 00 00 00 00", "485 01 00 40 1F")]),
    ("repeated Command", OPERATIONAL, [
        ("205 40 1F 01 01 00 00 00 00", "485 01 00 40 1F"),
        ("205 40 1F 01 01 00 00 00 00", "485 01 04 40 1F"),
    ]),
    ("Command before the start", PRE, [("205 40 1F 01 01 00 00 00 00", "")]),
    ("Command while stopped", STOPPED, [("205 40 1F 01 01 00 00 00 00", "")]),
    ("Command that is too short", OPERATIONAL, [
        ("205 40 1F 01 07", "085 10 82 11 … | 485 07 01 40 1F"),
        ("605 40 01 10 00", "585 4F 01 10 00 11"),
        ("605 40 03 10 01", "585 43 03 10 01 10 82"),
        ("205", "485 00 01 40 1F"),  # the error is still present
        ("205 40 1F 01 01 00 00 00 00", "085 00 00 00 … | 485 01 00 40 1F"),
        ("605 40 01 10 00", "585 4F 01 10 00"),
    ]),
    ("Command that is too short, before the start and while stopped", PRE, [
        ("205 40 1F 01 07", ""), ("000 02 05", ""), ("205 40 1F 01 07", ""), ("+0.1 085", ""),
    ]),
    ("a Command that is too short and a lost master", OPERATIONAL, [
        ("605 2F 29 10 01 01", "585 60 29 10 01"),
        _MONITOR_MASTER, ("77F 05", ""), ("205 40", "085 10 82 11 … | 485 00 01 40 1F"),
        ("+0.6 085", "085 30 81 11 …"), ("77F 05", ""), ("+0.1 085", "085 00 00 11 …"),
    ]),
    ("Command out of range", OPERATIONAL, [("205 01 00 01 02 00 00 00 00", "485 02 02 40 1F")]),
    ("Command to a disabled RPDO", OPERATIONAL, [
        ("605 23 00 14 01 05 02 00 80", "585 60 00 14 01"), ("205 40 1F 01 01 00 00 00 00", ""),
    ]),
    ("the last Command can be read", OPERATIONAL, [
        ("205 40 1F 01 09 00 00 00 00", "485 09 00 40 1F"),
        ("605 40 10 28 01", "585 4B 10 28 01 40 1F"),
        ("605 40 10 28 03", "585 4F 10 28 03 09"),
        ("605 40 03 28 01", "585 4F 03 28 01 09"),
    ]),
    ("a Command with a wrong length is not stored", OPERATIONAL, [
        ("205 40 1F 01 07", "085 10 82 … | 485 07 01 40 1F"), ("605 40 10 28 03", "585 4F 10 28 03"),
    ]),
    ("vent by SDO to the Command record", PRE, [("605 2F 10 28 02 00", "585 60 10 28 02")]),
]  # fmt: skip
