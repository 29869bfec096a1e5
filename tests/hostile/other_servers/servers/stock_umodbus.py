"""Server of uModbus with one thread per client: `python stock_umodbus.py PORT`.

Registers, coils and inputs share 200 values.
"""

import sys
from socketserver import ThreadingTCPServer

from umodbus.server.tcp import RequestHandler, get_server

SIZE = 200
words = [0] * SIZE
ThreadingTCPServer.daemon_threads = True
ThreadingTCPServer.allow_reuse_address = True
server = get_server(ThreadingTCPServer, ("127.0.0.1", int(sys.argv[1])), RequestHandler)


@server.route(slave_ids=[1], function_codes=[1, 2, 3, 4], addresses=list(range(SIZE)))
def read(slave_id, function_code, address):
    return words[address]


@server.route(slave_ids=[1], function_codes=[5, 6, 15, 16], addresses=list(range(SIZE)))
def write(slave_id, function_code, address, value):
    words[address] = value


server.serve_forever()
