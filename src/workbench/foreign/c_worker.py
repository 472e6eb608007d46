"""Runs a C formula: ``python -I c_worker.py LIBRARY SYMBOL SCRATCH``. Needs the standard library only.

It is a process of its own, so that a formula that writes where it may not ends nothing but itself.
"""

from __future__ import annotations

import ctypes
import os
import struct
import sys

MARK = "\x01workbench "
CANARY = 8


def main(library: str, symbol: str, scratch: str) -> None:
    """Load, say what was found, and answer requests."""
    out = sys.stdout
    try:
        loaded = ctypes.CDLL(library)
    except OSError as error:
        print(f"{MARK}refused {error}", file=out, flush=True)
        return
    batch = getattr(loaded, f"{symbol}_batch", None)
    single = getattr(loaded, symbol, None)
    function = batch or single
    if function is None:
        print(f"{MARK}refused no function {symbol} and no {symbol}_batch in it", file=out, flush=True)
        return
    function.restype = ctypes.c_int
    try:
        names = ctypes.string_at(ctypes.addressof(ctypes.c_char.in_dll(loaded, "workbench_parameters"))).decode()
    except ValueError:
        print(f"{MARK}refused no workbench_parameters in it, the names of what p holds", file=out, flush=True)
        return
    try:
        force = bool(ctypes.c_int.in_dll(loaded, "workbench_external_force").value)
    except ValueError:
        force = False
    print(f"{MARK}ready {int(force)} {names}", file=out, flush=True)
    for line in sys.stdin:
        if not line.strip():
            continue
        with open(os.path.join(scratch, "request.bin"), "rb") as stream:
            data = stream.read()
        n, na, count, arrays = (int(v) for v in struct.unpack_from("4d", data))
        numbers = (ctypes.c_double * (len(data) // 8)).from_buffer_copy(data)
        base, size = ctypes.addressof(numbers), ctypes.sizeof(ctypes.c_double)
        places, at = [], 4 + count
        for k in range(arrays):
            width = 3 if k == 3 else na
            places.append((base + at * size, width))
            at += n * width
        nan = float("nan")
        tau = (ctypes.c_double * (n * na + CANARY))(*([nan] * (n * na + CANARY)))
        parameters = ctypes.c_void_p(base + 4 * size)
        used = places if force else places[:3]
        code = 0
        if batch is not None:
            code = function(
                ctypes.c_int(n),
                parameters,
                *(ctypes.c_void_p(p) for p, _ in used),
                ctypes.c_void_p(ctypes.addressof(tau)),
            )
        else:
            for sample in range(n):
                code = function(
                    parameters,
                    *(ctypes.c_void_p(p + sample * width * size) for p, width in used),
                    ctypes.c_void_p(ctypes.addressof(tau) + sample * na * size),
                )
                if code:
                    break
        if code:
            print(f"{MARK}error returns {code}; 0 says that all is well", file=out, flush=True)
            continue
        if any(tau[n * na + k] == tau[n * na + k] for k in range(CANARY)):
            print(f"{MARK}error writes past tau, which has {na} entries a sample", file=out, flush=True)
            continue
        with open(os.path.join(scratch, "reply.bin"), "wb") as stream:
            stream.write(struct.pack("2d", n, na))
            stream.write(memoryview(tau).cast("B")[: n * na * size])
        print(f"{MARK}ok", file=out, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:4])
