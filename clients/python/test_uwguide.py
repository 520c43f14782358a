"""The client against a fake daemon: python3 -m unittest (in this folder)."""

import json
import socketserver
import threading
import unittest

from uwguide import Client, Refused


class Daemon(socketserver.StreamRequestHandler):
    """Answers as the daemon does, with pushes in between."""

    def handle(self):
        for line in self.rfile:
            request = json.loads(line)
            self.server.requests.append(request)
            reply = {"id": request["id"], "ok": True, "format": "uwguide/1"}
            if request["op"] == "suggest" and "depth_m" not in request:
                reply.update(ok=False, valid=False, reason="missing_input", action="hold")
                reply["error"] = {"code": "missing_field", "field": "depth_m", "message": "depth_m is missing"}
            elif request["op"] == "subscribe":
                self.tell(reply)
                for sequence in (1, 2):
                    self.tell({"id": request["id"], "ok": True, "push": True, "sequence": sequence})
                continue
            else:
                self.tell({"id": "older", "ok": True, "push": True, "sequence": 0})
                reply["valid"] = True
            self.tell(reply)

    def tell(self, reply):
        self.wfile.write(json.dumps(reply).encode() + b"\n")


class Exchange(unittest.TestCase):
    def setUp(self):
        self.server = socketserver.ThreadingTCPServer(("127.0.0.1", 0), Daemon)
        self.server.daemon_threads = True
        self.server.requests = []
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        self.address = "127.0.0.1:%d" % self.server.server_address[1]

    def tearDown(self):
        self.server.shutdown()
        self.server.server_close()

    def test_a_reply_is_found_between_pushes(self):
        with Client(self.address, token="secret") as client:
            self.assertTrue(client.suggest(depth_m=3.0)["valid"])
        self.assertEqual([r["op"] for r in self.server.requests], ["auth", "suggest"])
        self.assertEqual(self.server.requests[0]["token"], "secret")

    def test_a_refusal_is_an_exception_and_the_connection_goes_on(self):
        with Client(self.address) as client:
            with self.assertRaises(Refused) as refused:
                client.suggest()
            self.assertEqual((refused.exception.code, refused.exception.field), ("missing_field", "depth_m"))
            self.assertEqual(refused.exception.reason, "missing_input")
            self.assertTrue(client.predict([(1.0, 50.0)], depth_m=1.0)["ok"])
        self.assertEqual(self.server.requests[-1]["candidates"], [[1.0, 50.0]])

    def test_host_and_port_can_be_given_apart(self):
        host, port = self.server.server_address
        for arguments, names in (((host, port), {}), ((), {"host": host, "port": port}), ((), {"port": port})):
            with Client(*arguments, **names) as client:
                self.assertTrue(client.suggest(depth_m=3.0)["valid"])

    def test_a_subscription_yields_its_messages(self):
        with Client(self.address) as client:
            messages = client.subscribe(2.0)
            self.assertEqual([next(messages)["sequence"] for _ in range(2)], [1, 2])

    def test_what_is_no_json_is_not_sent(self):
        with Client(self.address) as client:
            with self.assertRaises(ValueError):
                client.state(depth_m=float("nan"))


if __name__ == "__main__":
    unittest.main()
