"""Objects 1010h (store parameters) and 1011h (restore default parameters) of CiA 301."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from pneuforce.registers.canopen.abort import AbortCode, SdoAbort
from pneuforce.registers.canopen.communication import LOAD_SIGNATURE, RESTORE, SAVE_SIGNATURE, STORE
from pneuforce.registers.canopen.entry import EntryAddress
from pneuforce.registers.canopen.parameter_storage import ParameterStorage, PendingWrite
from pneuforce.registers.canopen.parameters import Parameters

_SUBINDEXES = (1, 2)
STORAGE_ENTRIES: tuple[EntryAddress, ...] = tuple(
    (index, subindex) for index in (STORE, RESTORE) for subindex in _SUBINDEXES
)


def storage_actions(
    storage: ParameterStorage, parameters: Parameters
) -> Mapping[EntryAddress, Callable[[int], PendingWrite]]:
    """Return the function that carries out a write to each entry. Each function raises SdoAbort."""

    def save(signature: int) -> PendingWrite:
        return _store(storage, signature == SAVE_SIGNATURE, parameters.to_store())

    def load(signature: int) -> PendingWrite:
        return _store(storage, signature == LOAD_SIGNATURE, {})

    return {
        (index, subindex): action
        for index, action in ((STORE, save), (RESTORE, load))
        for subindex in _SUBINDEXES
    }


def _store(
    storage: ParameterStorage, right_signature: bool, values: Mapping[EntryAddress, int]
) -> PendingWrite:
    if not right_signature or not storage.can_store:
        raise SdoAbort(AbortCode.NOT_STORED)
    write = storage.store(storage.stored._replace(values=values))
    if write is None:
        raise SdoAbort(AbortCode.DEVICE_STATE)
    return write
