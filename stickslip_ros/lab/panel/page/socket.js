// Copyright 2026 The stickslip_ros maintainers
// SPDX-License-Identifier: Apache-2.0

// The way to the server: what it says comes in, what somebody wishes goes out.

const AGAIN_MS = 1000;
let socket = null;

/** Call the first function with what the server says, the second where it has gone; then try again. */
export function connect(hear, miss) {
  socket = new WebSocket(new URL("socket", location.href.replace("http", "ws")));
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => hear(data);
  socket.onclose = () => {
    miss();
    setTimeout(() => connect(hear, miss), AGAIN_MS);
  };
}

/** Have the server read a text or a file; return what it reads, or why it refuses. */
export function ask(kind, name, body) {
  return fetch(`${kind}?name=${encodeURIComponent(name)}`, { method: "POST", body }).then((answer) => answer.json())
    .catch(() => ({ refused: "the panel did not take it; it takes 8 MB at most" }));
}

export function wish(message) {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}
