"""Force sensor for asyncio: the same names as `ForceSensor`, as coroutines and asynchronous iterators."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from pneuforce.client.address import connect as connect_blocking
from pneuforce.client.details import Details
from pneuforce.client.holding import Hold
from pneuforce.client.measurement import Measurement
from pneuforce.client.sensor import ForceSensor

Result = TypeVar("Result")

#: Threads of a connection: a stream, a hold that waits, a request, and a vent, which must not wait for them.
THREADS = 4


def connect(url: str) -> Connecting:
    """Connect to the instrument at `url`, an address as for `pneuforce.connect`.

    Use the result in `async with`, or `await` it and close the sensor later.

    Example:
        import asyncio


        async def main():
            async with pneuforce.aio.connect("tcp://127.0.0.1:5020") as sensor:
                async with sensor.hold(5.5):
                    number = 0
                    async for measurement in sensor.stream():
                        number += 1
                        if number == 20:
                            break


        asyncio.run(main())
    """
    return Connecting(url)


class AsyncForceSensor:
    """Connection to one instrument, for asyncio. Its methods raise the same errors as `ForceSensor`."""

    def __init__(self, sensor: ForceSensor, executor: ThreadPoolExecutor) -> None:
        self.url = sensor.url
        self._sensor = sensor
        self._executor = executor

    async def __aenter__(self) -> AsyncForceSensor:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def close(self) -> None:
        """Close the connection. If the balloon is held through this connection, vent before."""
        try:
            await run_in(self._executor, self._sensor.close)
        finally:
            self._executor.shutdown(wait=False)

    async def read(self) -> Measurement:
        """Return the latest measurement. See `ForceSensor.read`."""
        return await run_in(self._executor, self._sensor.read)

    async def stream(self, timeout_s: float = 1.0) -> AsyncIterator[Measurement]:
        """Yield new measurements. See `ForceSensor.stream`."""
        samples = self._sensor.stream(timeout_s)
        step: asyncio.Future[Measurement] | None = None
        try:
            while True:
                step = asyncio.ensure_future(run_in(self._executor, lambda: next(samples)))
                yield await asyncio.shield(step)
        finally:
            if step is not None:  # a generator can be closed only when its last step has ended
                await asyncio.wait([step])
            samples.close()  # type: ignore[attr-defined]

    def hold(
        self,
        setpoint_kpa: float,
        *,
        lease_s: float = 2.0,
        timeout_s: float = 20.0,
        proof_tests: bool = True,
    ) -> AsyncHold:
        """Return an asynchronous context in which the balloon is held. See `ForceSensor.hold`."""
        hold = self._sensor.hold(setpoint_kpa, lease_s=lease_s, timeout_s=timeout_s, proof_tests=proof_tests)
        return AsyncHold(hold, self._executor)

    async def vent(self) -> None:
        """Open the vent valve. See `ForceSensor.vent`."""
        await run_in(self._executor, self._sensor.vent)

    async def wait_until_vented(self, timeout_s: float = 10.0) -> Measurement:
        """Wait until the balloon is verified to be empty. See `ForceSensor.wait_until_vented`."""
        return await run_in(self._executor, lambda: self._sensor.wait_until_vented(timeout_s))

    async def set_setpoint(self, setpoint_kpa: float) -> None:
        """Write the setpoint of the next hold. See `ForceSensor.set_setpoint`."""
        await run_in(self._executor, lambda: self._sensor.set_setpoint(setpoint_kpa))

    async def set_force_limit(self, force_limit_n: float) -> None:
        """Write the limit of the force alarm. See `ForceSensor.set_force_limit`."""
        await run_in(self._executor, lambda: self._sensor.set_force_limit(force_limit_n))

    async def release(self) -> None:
        """Vent, and end the lease. See `ForceSensor.release`."""
        await run_in(self._executor, self._sensor.release)

    async def details(self) -> Details:
        """Return the fault, the lease and the versions. See `ForceSensor.details`."""
        return await run_in(self._executor, self._sensor.details)

    async def clear(self) -> None:
        """Clear the latched faults. See `ForceSensor.clear`."""
        await run_in(self._executor, self._sensor.clear)

    async def zero(self) -> None:
        """Make a zero adjustment. See `ForceSensor.zero`."""
        await run_in(self._executor, self._sensor.zero)

    async def new_balloon(self, balloon_id: int) -> None:
        """Store that another balloon was mounted. See `ForceSensor.new_balloon`."""
        await run_in(self._executor, lambda: self._sensor.new_balloon(balloon_id))


class AsyncHold:
    """Asynchronous context in which the balloon is held. A cancelled task vents the balloon, too."""

    def __init__(self, hold: Hold, executor: ThreadPoolExecutor) -> None:
        self._hold = hold
        self._executor = executor

    async def __aenter__(self) -> AsyncHold:
        begin = asyncio.ensure_future(run_in(self._executor, self._hold.__enter__))
        try:
            await asyncio.shield(begin)
        except asyncio.CancelledError:
            self._hold.cancel()
            await asyncio.wait([begin])
            if not begin.cancelled() and begin.exception() is None:  # cancelled at the moment of the success
                await run_in(self._executor, self._hold.end)
            raise
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: object
    ) -> None:
        end = asyncio.ensure_future(run_in(self._executor, lambda: self._hold.__exit__(kind, error, None)))
        try:
            await asyncio.shield(end)
        except asyncio.CancelledError:
            await asyncio.wait([end])
            raise


class Connecting:
    """Connection that is being opened. Use it in `async with` or with `await`."""

    def __init__(self, url: str) -> None:
        self._url = url
        self._sensor: AsyncForceSensor | None = None

    def __await__(self) -> Generator[None, None, AsyncForceSensor]:
        return self._open().__await__()

    async def __aenter__(self) -> AsyncForceSensor:
        self._sensor = await self._open()
        return self._sensor

    async def __aexit__(self, *_: object) -> None:
        if self._sensor is not None:
            await self._sensor.close()

    async def _open(self) -> AsyncForceSensor:
        executor = ThreadPoolExecutor(THREADS, thread_name_prefix="pneuforce")
        try:
            sensor = await run_in(executor, lambda: connect_blocking(self._url))
        except BaseException:
            executor.shutdown(wait=False)
            raise
        return AsyncForceSensor(sensor, executor)


async def run_in(executor: ThreadPoolExecutor, call: Callable[[], Result]) -> Result:
    """Return the result of a blocking call in a thread of the executor.

    After `close`, the executor accepts no call. A call of a closed sensor does not block: it raises
    SensorClosed.
    """
    try:
        running = asyncio.get_running_loop().run_in_executor(executor, call)
    except RuntimeError:
        return call()
    return await running
