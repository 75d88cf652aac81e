# A ship that answers lines of text on port 5555 of this machine, until it is stopped.
import socketserver


class Ship(socketserver.StreamRequestHandler):
    def handle(self):
        rate = heading = rudder = 0.0
        for line in self.rfile:
            words = line.split()
            if words[0] == b"write":
                # The rudder goes no further than 0.4 rad.
                rudder = max(-0.4, min(0.4, float(words[1])))
                answer = f"{rudder}\n"
            else:
                heading += 0.1 * rate
                rate += 0.1 * (0.25 * rudder - 0.5 * rate - 4 * rate**3)
                answer = f"{rate} {heading}\n"
            self.wfile.write(answer.encode())


socketserver.TCPServer.allow_reuse_address = True
socketserver.TCPServer(("127.0.0.1", 5555), Ship).serve_forever()
