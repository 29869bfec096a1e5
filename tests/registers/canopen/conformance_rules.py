"""Table of the rules of CiA 301 and CiA 305 that a conformance test checks, with the evidence for this node.

A rule is met if all its evidence passes. Evidence is the name of a case in cases.py, or "file::test" for a
test in this folder, in tests/registers/views or in tests/system. A rule without evidence does not apply.
"""

from __future__ import annotations

from typing import NamedTuple


class Rule(NamedTuple):
    """Rule of a standard."""

    text: str
    evidence: tuple[str, ...] = ()
    reason: str = ""  #: why the rule does not apply


class Area(NamedTuple):
    """Service with its rules."""

    name: str
    section: str  #: section of CiA 301, or another document
    support: str  #: yes, partly or no
    remark: str
    rules: tuple[Rule, ...]


_NO_GUARDING = "The node has no node guarding. CiA 301 recommends the heartbeat instead."
_NO_BLOCK = "The node has no block transfer, which is optional. The request is aborted with 0504 0001h."
_NO_SYNC_PRODUCER = "The node does not send SYNC messages."
_FIXED_MAPPING = (
    "The mapping is fixed, so that a Force frame always has the content that its receiver expects."
)
_NO_DUMMIES = "The mapping is fixed, and the data sheet lists no dummy objects."
_ONE_CONSUMER = "1016h has one entry, so that no entry can be listed twice."
_NO_WRITE_ONLY = "The dictionary has no object that can only be written."
_SAVED = "test_storage::test_stored_parameters_survive_a_reset_and_a_restart_until_they_are_restored"
_SIGNATURE = "test_storage::test_a_wrong_signature_is_aborted"
_READ_ONLY = "test_writes::test_a_read_only_entry_cannot_be_written"
_READABLE = "test_writes::test_every_entry_can_be_read_except_an_empty_error_history_and_autozero"
_EDS_AGREES = "test_eds::test_python_canopen_reads_type_access_and_default_of_each_entry"

DATA_SHEET = Area(
    "Electronic data sheet",
    "CiA 306",
    "yes",
    "The data sheet is generated from the object dictionary.",
    (
        Rule(
            "The file has the sections and keys of the standard.",
            (
                "test_eds::test_the_head_has_every_key",
                "test_eds::test_each_entry_has_the_keys_of_an_entry",
                "test_eds::test_dates_and_times_have_the_format_of_the_standard",
                "test_eds::test_the_checker_of_lely_reports_nothing",
            ),
        ),
        Rule(
            "Each object of the device is listed, with its sub-indexes, in the list for its index.",
            (
                "test_eds::test_python_canopen_finds_exactly_the_objects_of_the_dictionary",
                "test_eds::test_each_object_is_in_the_list_for_its_index",
                "test_eds::test_each_section_is_an_object_that_is_listed_with_its_sub_indices",
            ),
        ),
        Rule("Data type, access and default value of each object agree with the device.", (_EDS_AGREES,)),
        Rule(
            "The limits of each object agree with the device.",
            ("test_eds::test_the_limits_agree_with_the_node",),
        ),
    ),
)

SDO = Area(
    "SDO server",
    "7.2.4",
    "partly",
    "One server with fixed identifiers; expedited and segmented transfers; no block transfers.",
    (
        Rule("A value of up to 4 bytes is read by an expedited transfer.", ("device type",)),
        Rule("A longer value is read in segments, and the announced size is right.", ("text in segments",)),
        Rule("A parameter is written and read back by expedited transfers.", ("heartbeat time",)),
        Rule(
            "A parameter is written in segments.",
            ("heartbeat time in one segment", "setpoint in two segments"),
        ),
        Rule(
            "A write to a read-only object is aborted with 0601 0002h.",
            ("device type is constant", _READ_ONLY),
        ),
        Rule("A read of a write-only object is aborted with 0601 0001h.", reason=_NO_WRITE_ONLY),
        Rule(
            "A request for an object that does not exist is aborted with 0602 0000h.",
            ("unknown object", "write to an unknown object"),
        ),
        Rule(
            "A request for a sub-index that does not exist is aborted with 0609 0011h.",
            ("unknown sub-index of a variable", "unknown sub-index of a record"),
        ),
        Rule("An unknown command specifier is aborted with 0504 0001h.", ("unknown specifier",)),
        Rule(
            "A value with too many bytes is aborted with 0607 0012h.",
            ("mode in four bytes", "too many bytes in segments"),
        ),
        Rule(
            "A value with too few bytes is aborted with 0607 0013h.",
            ("heartbeat time in one byte", "too few bytes in segments"),
        ),
        Rule(
            "A value above the limit is aborted with 0609 0031h, a value below the limit with 0609 0032h.",
            ("setpoint 12.5 kPa", "setpoint 1.5 kPa"),
        ),
        Rule(
            "A wrong toggle bit is aborted with 0503 0000h.",
            ("wrong toggle bit in an upload", "wrong toggle bit in a download", "repeated segment"),
        ),
        Rule(
            "A transfer whose next segment does not arrive is aborted with 0504 0000h.",
            ("transfer without the next request", "the timeout restarts with each segment"),
        ),
        Rule("An abort of the client ends the transfer without a response.", ("abort by the client",)),
        Rule(
            "A request of a wrong length, or for another node, is not answered.",
            ("four bytes", "seven bytes", "another node"),
        ),
        Rule(
            "A server that has no block transfer aborts its initiation with 0504 0001h.",
            ("block upload", "block download"),
        ),
        Rule("A block transfer with and without checksum transfers the right bytes.", reason=_NO_BLOCK),
        Rule("A block transfer with a wrong block size or sequence number is aborted.", reason=_NO_BLOCK),
        Rule("1200h contains the identifiers of the server.", ("SDO request COB-ID", "SDO response COB-ID")),
        Rule(
            "Further servers (1201h to 127Fh) and clients (1280h to 12FFh) keep stored identifiers.",
            reason="The node has one server and no client.",
        ),
        Rule(
            "Objects of servers and clients that do not exist are aborted with 0602 0000h.",
            ("object 1201h is not supported", "object 1280h is not supported"),
        ),
    ),
)

DICTIONARY = Area(
    "Object dictionary",
    "7.4",
    "yes",
    "",
    (
        Rule("Each object can be read according to its access type.", (_READABLE,)),
        Rule("Each read-only object rejects a write.", (_READ_ONLY,)),
        Rule("The default values agree with the data sheet.", (_EDS_AGREES,)),
        Rule(
            "Each parameter that can be written accepts only values within its limits.",
            ("test_any_bytes::test_after_any_requests_the_server_responds_and_every_parameter_is_allowed",),
        ),
        Rule("Sub-index 255 describes the structure of the object.", reason="Sub-index 255 is optional."),
        Rule(
            "The flags of an object (ObjFlags) control which tool writes it.",
            reason="The data sheet uses no flags, which are optional.",
        ),
    ),
)

PDO = Area(
    "PDO",
    "7.2.2",
    "partly",
    "Four TPDOs and one RPDO. Mapping and identifiers are fixed; no remote frames; no synchronous RPDO; no "
    "SYNC start value.",
    (
        Rule(
            "Each PDO has a communication parameter with the default identifier.",
            ("RPDO 1 COB-ID", "TPDO 1 COB-ID, no remote frames", "TPDO 4 COB-ID, no remote frames"),
        ),
        Rule(
            "Bit 31 of the identifier disables and enables a PDO.",
            (
                "TPDO disabled and enabled",
                "Command to a disabled RPDO",
                "test_pdo::test_a_tpdo_can_be_disabled_and_enabled",
            ),
        ),
        Rule(
            "Reserved transmission types are rejected, and supported types are accepted.",
            ("transmission types", "transmission type 241", "transmission type 253", "synchronous RPDO"),
        ),
        Rule(
            "A TPDO of type 254 or 255 is sent at events.",
            ("test_pdo::test_without_an_event_timer_a_tpdo_is_sent_only_at_events",),
        ),
        Rule(
            "The event timer sends a TPDO without events.",
            ("test_pdo::test_the_event_timer_sends_a_tpdo_without_events",),
        ),
        Rule(
            "The inhibit time is the shortest time between two TPDOs, and is fixed while the PDO is enabled.",
            (
                "test_pdo::test_the_inhibit_time_is_the_shortest_time_between_force_frames",
                "inhibit time of an enabled TPDO",
                "inhibit time of a disabled TPDO",
            ),
        ),
        Rule("A TPDO of type 1 to 240 is sent at each n-th SYNC.", ("at each SYNC", "at each third SYNC")),
        Rule(
            "A TPDO of type 0 is sent at the SYNC after an event.",
            ("test_pdo::test_transmission_type_0_is_sent_only_at_the_sync_after_an_event",),
        ),
        Rule(
            "All PDOs of a SYNC contain the values at this SYNC.",
            ("test_pdo::test_all_tpdos_of_a_sync_contain_the_sample_at_this_sync",),
        ),
        Rule(
            "The SYNC start value delays the first PDO until this counter.",
            reason="Sub-index 6 is optional, and the node ignores the counter of SYNC.",
        ),
        Rule(
            "A remote frame requests a TPDO.",
            reason="Bit 30 of each TPDO forbids remote frames. CiA recommends not to use them.",
        ),
        Rule(
            "A remote frame is ignored if bit 30 is set.",
            ("test_any_bytes::test_a_remote_or_extended_request_is_ignored", "remote frames allowed"),
        ),
        Rule(
            "No PDO is sent in the states pre-operational and stopped, at events, at timers or at SYNC.",
            (
                "no TPDO before the start",
                "no TPDO while stopped",
                "SYNC before the start",
                "SYNC while stopped",
            ),
        ),
        Rule(
            "The mapping lists objects that exist, that can be mapped, and that have the mapped length.",
            (
                "test_eds::test_the_mapping_covers_each_frame_byte_by_byte_and_only_mapped_entries_are_mappable",
            ),
        ),
        Rule("A new mapping is accepted while the PDO is disabled.", reason=_FIXED_MAPPING),
        Rule(
            "A new mapping is rejected while the PDO is enabled, or without the mapping procedure.",
            ("mapping is fixed: mapped object", "RPDO mapping is fixed"),
        ),
        Rule(
            "A mapping of objects that do not exist, or of too many objects, is rejected.",
            ("mapping is fixed: an object that does not exist", "mapping is fixed: too many objects"),
        ),
        Rule(
            "Only objects with a suitable access type can be mapped to an RPDO or a TPDO.",
            reason=_FIXED_MAPPING,
        ),
        Rule("Dummy objects fill unused bytes of an RPDO.", reason=_NO_DUMMIES),
        Rule(
            "An RPDO that is too short is not processed.",
            (
                "Command that is too short",
                "a Command with a wrong length is not stored",
            ),
        ),
    ),
)

EMERGENCY = Area(
    "Emergency",
    "7.2.7",
    "yes",
    "1014h is fixed. 1015h (inhibit time), 1003h (history), 1029h (error behaviour).",
    (
        Rule("1014h contains the default identifier.", ("emergency COB-ID", "emergency COB-ID is fixed")),
        Rule("1001h contains the error register, and is 0 without errors.", ("new fault", "fault cleared")),
        Rule(
            "1003h contains the errors, the newest first; an empty field is aborted with 0800 0024h.",
            ("error history, the newest first",),
        ),
        Rule(
            "Writing 0 to 1003h:0 clears the history, and any other value is rejected.",
            ("error history cleared", "error history set to 1"),
        ),
        Rule(
            "An RPDO that is too short causes the emergency 8210h, with the communication bit of 1001h.",
            ("Command that is too short", "a Command that is too short and a lost master"),
        ),
        Rule(
            "An RPDO that is too long causes the emergency 8220h.",
            ("test_emergency::test_a_command_that_is_too_long_is_not_carried_out",),
        ),
        Rule(
            "The end of an error causes the emergency 0000h.", ("fault cleared", "one of two faults cleared")
        ),
        Rule("The inhibit time separates two emergencies.", ("emergencies with an inhibit time",)),
        Rule("No emergency is sent in the state stopped.", ("emergency is sent after stopped",)),
    ),
)

SYNC = Area(
    "SYNC",
    "7.2.5",
    "partly",
    "Consumer only. 1006h, 1007h and 1019h do not exist.",
    (
        Rule("1005h contains the default identifier.", ("SYNC COB-ID",)),
        Rule("A device without SYNC producer rejects bit 30 of 1005h.", ("SYNC COB-ID is fixed",)),
        Rule("A SYNC message with and without a counter is received.", ("at each SYNC",)),
        Rule("SYNC messages are sent with the period 1006h.", reason=_NO_SYNC_PRODUCER),
        Rule("The counter of SYNC counts to the overflow value 1019h.", reason=_NO_SYNC_PRODUCER),
        Rule(
            "1019h rejects the values 1 and 241 to 255, and any value while a period is set.",
            reason=_NO_SYNC_PRODUCER,
        ),
        Rule("The configuration of SYNC is stored.", reason=_NO_SYNC_PRODUCER),
    ),
)

TIME = Area(
    "TIME",
    "7.2.6",
    "no",
    "No measured value could carry the time stamp: the frames have no free bytes, and two SDO transfers do "
    "not belong to the same sample.",
    (Rule("1012h contains the identifier of TIME.", reason="TIME is optional."),),
)

HEARTBEAT = Area(
    "Heartbeat",
    "7.2.8.3.2.2",
    "yes",
    "One monitored master (1016h:1).",
    (
        Rule("1017h is the period of the heartbeat.", ("heartbeat twice as fast",)),
        Rule("1017h = 0 disables the heartbeat.", ("no heartbeat",)),
        Rule(
            "The monitoring starts with the first heartbeat.",
            ("a master without a first heartbeat is not lost", "heartbeat of another node"),
        ),
        Rule(
            "A heartbeat that arrives in time is not an error.",
            ("a master that sends heartbeats is not lost",),
        ),
        Rule(
            "A heartbeat that is late causes the emergency 8130h and the error behaviour 1029h.",
            (
                "master lost",
                "master lost, to pre-operational",
                "master lost, no change of state",
                "master lost, to stopped",
            ),
        ),
        Rule(
            "After a reset, the heartbeat is monitored again from its first message.",
            ("a reset restores the master to be monitored",),
        ),
        Rule("Two entries of 1016h with the same node id are rejected.", reason=_ONE_CONSUMER),
    ),
)

GUARDING = Area(
    "Node guarding",
    "7.2.8.3.2.1",
    "no",
    "The heartbeat replaces node guarding.",
    (
        Rule(
            "A device without node guarding has no objects 100Ch and 100Dh.",
            ("object 100Ch is not supported", "object 100Dh is not supported"),
        ),
        Rule(
            "A remote frame for the heartbeat identifier is not answered.",
            ("test_ignored::test_a_remote_or_extended_frame_is_counted_once",),
        ),
        Rule("The guard message contains the state and a toggle bit.", reason=_NO_GUARDING),
        Rule("The life time is monitored.", reason=_NO_GUARDING),
        Rule("Heartbeat and node guarding are not used at the same time.", reason=_NO_GUARDING),
    ),
)

STORAGE = Area(
    "Store and restore parameters",
    "objects 1010h and 1011h",
    "yes",
    "1010h and 1011h with the sub-indexes 1 (all) and 2 (communication). The registers are no parameters.",
    (
        Rule("A wrong signature is aborted with 0800 002xh, and nothing is stored.", (_SIGNATURE,)),
        Rule("Stored parameters are used after a reset.", (_SAVED,)),
        Rule(
            "Without a save, a reset restores the defaults.",
            ("test_storage::test_without_a_save_a_reset_restores_the_defaults_and_no_file_is_written",),
        ),
        Rule("Restored defaults are used after a reset.", (_SAVED,)),
        Rule(
            "A failed save is aborted with 0606 0000h.",
            ("test_storage::test_a_file_that_cannot_be_written_is_aborted_and_changes_nothing",),
        ),
        Rule(
            "1010h and 1011h state whether storing is supported.",
            ("test_storage::test_without_a_file_nothing_can_be_stored_and_the_objects_say_so",),
        ),
        Rule("1020h contains date and time of the stored configuration.", reason="1020h is optional."),
        Rule(
            "Identifiers of other services are rejected for 1005h, 1012h, 1014h and the PDOs.",
            ("SYNC COB-ID is fixed", "emergency COB-ID is fixed", "changed COB-ID", "SDO COB-ID is fixed"),
        ),
    ),
)

NMT = Area(
    "Network management",
    "7.2.8, 7.3.2",
    "yes",
    "Minimum boot-up; slave only.",
    (
        Rule(
            "After its start and after each reset, the node sends the boot-up message.",
            ("reset of the node", "reset of communication", "reset of all nodes"),
        ),
        Rule(
            "After the boot-up message, the state is pre-operational.",
            ("heartbeat before the start", "reset of the node"),
        ),
        Rule(
            "A reset restores all communication parameters.",
            ("a reset restores the defaults", "a reset restores the master to be monitored"),
        ),
        Rule(
            "In pre-operational, SDO and heartbeat work, and PDOs do not.",
            ("device type", "no TPDO before the start"),
        ),
        Rule(
            "In operational, SDO, PDO and heartbeat work.",
            ("read in operational", "a new start sends State at once"),
        ),
        Rule(
            "In stopped, only heartbeat and NMT work.",
            ("SDO request while stopped", "no TPDO while stopped", "from stop to pre-operational"),
        ),
        Rule(
            "Start, stop and enter pre-operational are executed in each state.",
            (
                "start",
                "start from stop",
                "stop",
                "stop before the start",
                "back to pre-operational",
                "from stop to pre-operational",
            ),
        ),
        Rule(
            "A command for all nodes is executed, and a command for another node is not.",
            ("start of all nodes", "start of another node"),
        ),
        Rule(
            "Unknown commands and commands of a wrong length are ignored.",
            ("unknown NMT command", "NMT command of one byte", "NMT command of three bytes"),
        ),
    ),
)

LSS = Area(
    "Layer setting services",
    "CiA 305",
    "partly",
    "The bit rate cannot be changed. The node always has a node id, so that fastscan does not apply.",
    (
        Rule(
            "Switch state global and selective.",
            (
                "test_lss::test_a_master_selects_the_node_by_its_address_and_reads_it_back",
                "test_lss::test_another_address_does_not_select_the_node",
            ),
        ),
        Rule(
            "Inquire vendor id, product code, revision number, serial number and node id.",
            ("test_lss::test_a_master_selects_the_node_by_its_address_and_reads_it_back",),
        ),
        Rule("Identify remote slave.", ("test_lss::test_a_master_finds_the_node_in_a_range_of_addresses",)),
        Rule(
            "Configure node id; the new node id is used after a reset of communication.",
            (
                "test_lss::test_a_configured_node_id_is_used_after_a_reset",
                "test_lss::test_an_invalid_node_id_is_refused",
            ),
        ),
        Rule(
            "Configure bit timing reports an error if the bit rate is not supported.",
            ("test_lss::test_only_the_present_bit_rate_can_be_configured",),
        ),
        Rule("Activate bit timing.", reason="The bit rate belongs to the CAN interface of the computer."),
        Rule(
            "Store configuration; the stored node id is used after a restart.",
            ("test_lss::test_a_stored_node_id_is_used_after_a_restart",),
        ),
        Rule("Identify non-configured slave, and fastscan.", reason="The node always has a node id."),
        Rule(
            "An LSS master of another project performs these services.",
            (
                "test_canopen::test_the_lss_master_of_python_canopen_changes_the_node_id_until_it_is_changed_back",
            ),
        ),
    ),
)

#: Deviations from the standards that are intended.
DEVIATIONS = (
    "A Command with mode 0 (vent) is executed in each state, and if RPDO 1 is disabled.",
    "A monitoring of the master that has started continues after a reset, until 1016h:1 is written.",
    "A boot-up message of the monitored master is not counted as its heartbeat.",
    "Reset node and reset communication have the same effect, because the registers belong to all buses.",
    "A node id that LSS has configured is not used while the balloon is inflated.",
    "The vendor id is 0, because CiA has not assigned one.",
)

AREAS = (
    DATA_SHEET,
    SDO,
    DICTIONARY,
    PDO,
    EMERGENCY,
    SYNC,
    TIME,
    HEARTBEAT,
    GUARDING,
    STORAGE,
    NMT,
    LSS,
)
