// Client of the Foxglove WebSocket protocol, as far as the page needs it: subscriptions by topic
// and calls of services, which outlast a restart of the server.

const MESSAGE = 1;
const SERVICE_CALL = 2;
const SERVICE_RESPONSE = 3;
const RETRY_MS = { first: 500, most: 8000 };
// Requests without an answer; a server that is stuck gets no more.
const CALLS_MAX = 16;

class Connection {
  // `listener` has: advertised(channels), connected(session), disconnected(retryMs), failed(text).
  constructor(url, listener) {
    this.url = url;
    this.listener = listener;
    this.wanted = new Map(); // handlers by topic
    this.retryMs = RETRY_MS.first;
    this.nextId = 1;
    this.#reset();
  }

  #reset() {
    this.isOpen = false;
    this.channels = new Map(); // by identifier
    this.subscriptions = new Map(); // topics by identifier
    this.services = new Map(); // identifiers by name
    this.calls = new Map(); // promises by identifier
  }

  open() {
    this.socket = new WebSocket(this.url, ["foxglove.sdk.v1"]);
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = ({ data: message }) => {
      if (typeof message === "string") this.#text(JSON.parse(message));
      else this.#binary(new DataView(message));
    };
    this.socket.onclose = () => {
      const open = this.calls;
      this.#reset();
      for (const { reject } of open.values()) reject(new Error("not connected"));
      this.listener.disconnected(this.retryMs);
      setTimeout(() => this.open(), this.retryMs);
      this.retryMs = Math.min(2 * this.retryMs, RETRY_MS.most);
    };
  }

  // Calls `handler(logTimeNs, view, offset)` for each message of a topic, now and after reconnects.
  subscribe(topic, handler) {
    this.wanted.set(topic, handler);
    this.#subscribe([...this.channels.values()].filter((channel) => channel.topic === topic));
  }

  unsubscribe(topic) {
    this.wanted.delete(topic);
    const ids = [...this.subscriptions].filter(([, it]) => it === topic).map(([id]) => id);
    for (const id of ids) this.subscriptions.delete(id);
    if (ids.length) this.#send({ op: "unsubscribe", subscriptionIds: ids });
  }

  #subscribe(channels) {
    const known = new Set(this.subscriptions.values());
    const subscriptions = channels
      .filter(({ topic }) => this.wanted.has(topic) && !known.has(topic))
      .map(({ id, topic }) => {
        this.subscriptions.set(this.nextId, topic);
        return { id: this.nextId++, channelId: id };
      });
    if (subscriptions.length) this.#send({ op: "subscribe", subscriptions });
  }

  #send(message) {
    this.socket.send(JSON.stringify(message));
  }

  #text(message) {
    if (message.op === "serverInfo") {
      this.isOpen = true;
      this.retryMs = RETRY_MS.first;
      this.listener.connected(message.sessionId);
    } else if (message.op === "advertise") {
      for (const channel of message.channels) this.channels.set(channel.id, channel);
      this.listener.advertised(message.channels);
      this.#subscribe(message.channels);
    } else if (message.op === "unadvertise") {
      for (const id of message.channelIds) {
        const gone = this.channels.get(id)?.topic;
        this.channels.delete(id);
        for (const [number, topic] of this.subscriptions) if (topic === gone) this.subscriptions.delete(number);
      }
    } else if (message.op === "advertiseServices") {
      for (const { id, name } of message.services) this.services.set(name, id);
    } else if (message.op === "serviceCallFailure") {
      this.#settle(message.callId, (call) => call.reject(new Error(message.message)));
    } else if (message.op === "status" && message.level === 2) {
      this.listener.failed(message.message);
    }
  }

  #binary(view) {
    const kind = view.getUint8(0);
    if (kind === MESSAGE) {
      // A message may still arrive after its subscription has ended.
      const handler = this.wanted.get(this.subscriptions.get(view.getUint32(1, true)));
      handler?.(view.getBigUint64(5, true), view, 13);
    } else if (kind === SERVICE_RESPONSE) {
      const answer = json(view, 13 + view.getUint32(9, true));
      this.#settle(view.getUint32(5, true), (call) => {
        if (answer.ok) call.resolve(answer);
        else call.reject(new Error(answer.error ?? answer.message ?? "refused"));
      });
    }
  }

  #settle(id, settle) {
    const call = this.calls.get(id);
    this.calls.delete(id);
    if (call) settle(call);
  }

  // Calls a service; the promise is rejected with the text of the server.
  call(name, request) {
    const service = this.services.get(name);
    if (!this.isOpen) return Promise.reject(new Error("not connected"));
    if (service === undefined) return Promise.reject(new Error(`the server has no service “${name}”`));
    if (this.calls.size >= CALLS_MAX) return Promise.reject(new Error("the server does not answer"));
    const encode = (text) => new TextEncoder().encode(text);
    const [encoding, payload] = [encode("json"), encode(JSON.stringify(request))];
    const view = new DataView(new ArrayBuffer(13 + encoding.length + payload.length));
    const id = this.nextId++;
    view.setUint8(0, SERVICE_CALL);
    [service, id, encoding.length].forEach((number, i) => view.setUint32(1 + 4 * i, number, true));
    new Uint8Array(view.buffer, 13).set(encoding);
    new Uint8Array(view.buffer, 13 + encoding.length).set(payload);
    this.socket.send(view);
    return new Promise((resolve, reject) => this.calls.set(id, { resolve, reject }));
  }
}

// Returns the value of JSON text from an offset to the end of a message.
function json(view, offset) {
  return JSON.parse(new TextDecoder().decode(new Uint8Array(view.buffer, offset)));
}
