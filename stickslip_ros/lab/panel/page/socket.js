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

export function wish(message) {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}
