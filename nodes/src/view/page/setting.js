// The chosen signal in words, and the form that sets it.

import { byId, make, number, unitOf, write } from "./document.js";

const TOKEN = "isochrone-token";

/** The token of the URL. It is taken out of the address, and kept for as long as the tab is open. */
function token() {
  const given = /^#token=([0-9a-f]+)$/.exec(location.hash)?.[1];
  if (given) {
    sessionStorage.setItem(TOKEN, given);
    history.replaceState(null, "", location.pathname);
  }
  return sessionStorage.getItem(TOKEN);
}

export class Setting {
  constructor(closed) {
    this.token = token();
    this.isWritable = false;
    this.signal = null;
    byId("setting").addEventListener("submit", event => {
      event.preventDefault();
      this.send("/set", { name: this.signal.name, value: byId("setting-value").value });
    });
    const close = () => {
      this.signal = null;
      byId("chosen").hidden = true;
      closed();
    };
    byId("chosen-close").addEventListener("click", close);
    byId("chosen").addEventListener("keydown", event => event.key === "Escape" && close());
  }

  /** Shows a signal. */
  show(signal, line) {
    if (signal.name !== this.signal?.name) this.tell("", "");
    this.signal = signal;
    byId("chosen").hidden = false;
    write(byId("chosen-name"), signal.name);
    write(byId("chosen-doc"), [signal.comment, signal.doc].filter(Boolean).join(" · "));
    byId("setting-value").value = "";
    this.update(line);
    if (!byId("setting").hidden) byId("setting-value").focus();
    else byId("chosen").scrollIntoView({ block: "nearest" });
  }

  /** Access or values have changed. */
  update(line) {
    const signal = this.signal;
    if (!signal) return;
    const flags = line?.flags?.length ? `flags ${line.flags.join(" ")}` : "";
    const facts = [signal.role, signal.type, unitOf(signal), `task ${signal.task}`,
      line?.value ? `now ${line.value}` : line?.why ?? "", signal.protected ? "protected" : "", flags];
    write(byId("chosen-facts"), facts.filter(Boolean).join(" · "));
    write(byId("setting-limits"), signal.limits ? `${number(signal.limits[0])} to ${number(signal.limits[1])}` : "");
    const why = this.whyNot();
    byId("setting").hidden = why !== "";
    byId("why-not").hidden = why === "";
    write(byId("why-not"), why);
  }

  /** Why the signal cannot be set here. */
  whyNot() {
    if (!["parameter", "variable"].includes(this.signal.role)) return "Only parameters and variables can be set.";
    if (!this.isWritable) return "This page is for reading; `isochrone view --allow-write` makes one that sets parameters.";
    if (!this.token) return "To set parameters, open the URL that `isochrone view` has printed, with its token.";
    if (this.signal.protected) return "The configuration protects this signal ([[protect]]).";
    if (!["set", "force"].includes(this.access)) return `The node's configuration does not allow it (control = "${this.access}").`;
    return "";
  }

  /** Whether the page may set parameters and acknowledge alarms. */
  mayChange() {
    return this.isWritable && Boolean(this.token) && ["set", "force"].includes(this.access);
  }

  post(path, body) {
    const headers = { "Content-Type": "application/json", "X-Isochrone-Token": this.token };
    return fetch(path, { method: "POST", headers, body: JSON.stringify(body) });
  }

  /** Acknowledges what is shown of an alarm; returns why that was not possible. */
  async acknowledge({ name, occurrence }) {
    try {
      const answer = await this.post("/ack", { alarm: name, occurrence });
      return answer.ok ? "" : (await answer.text()).trim();
    } catch {
      return "isochrone view does not answer; whether the alarm was acknowledged is not known";
    }
  }

  async send(path, body) {
    this.tell("asked the node …", "");
    try {
      const answer = await this.post(path, body);
      if (!answer.ok) return this.tell((await answer.text()).trim(), "refused");
      const { transaction, told, warnings } = await answer.json();
      const undo = make("button", { type: "button" }, "Undo");
      undo.addEventListener("click", () => this.send("/undo", { transaction }));
      this.tell(`${told}, transaction ${transaction}`, "", path === "/set" ? undo : "");
      for (const warning of warnings) byId("told").append(make("p", { className: "bad" }, `warning: ${warning}`));
      if (path === "/set") byId("setting-value").value = "";
    } catch {
      this.tell("isochrone view does not answer; whether the value was set is not known", "refused");
    }
  }

  tell(text, kind, ...more) {
    const told = byId("told");
    told.className = kind;
    told.replaceChildren(text, ...more);
  }
}
