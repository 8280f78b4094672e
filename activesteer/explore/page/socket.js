// The connection to the server: JSON out; in come a length, a JSON header, and arrays of 32-bit numbers.
export class Socket {
  constructor(heard, lost) {
    const address = new URL("socket", location.href);
    address.protocol = "ws:";
    this.socket = new WebSocket(address);
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = ({ data }) => {
      const length = new DataView(data).getUint32(0, true);
      const header = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
      let place = 4 + length;
      const arrays = header.arrays.map((shape) => {
        const size = shape.reduce((a, b) => a * b, 1), values = new Float32Array(data, place, size);
        place += 4 * size;
        return values;
      });
      heard(header, arrays);
    };
    this.socket.onclose = ({ reason }) => {
      this.lost = () => lost(reason || "The connection to the program has ended. Start `activesteer explore` again and open its new address.");
      this.lost();
    };
  }

  // Without a connection, every message is answered by the reason.
  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
    else this.lost?.();
  }
}
