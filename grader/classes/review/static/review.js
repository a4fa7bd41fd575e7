"use strict";

const told = (form, text, bad) => {
  const place = form.querySelector(".told");
  place.textContent = text;
  place.classList.toggle("bad", Boolean(bad));
};

const fields = (form) => [...form.querySelectorAll("input:not([type=hidden]), textarea")];
const typed = (form) => JSON.stringify(fields(form).map((field) => (field.type === "checkbox" ? field.checked : field.value)));
const written = (form) => JSON.stringify(fields(form).map((field) => (field.type === "checkbox" ? field.defaultChecked : field.defaultValue)));

const settle = (form) => {
  form.dataset.at = typed(form);
  form.classList.remove("unsaved");
};

const unsaved = () => [...document.querySelectorAll("form.decide")].filter((form) => typed(form) !== form.dataset.at);

const put = (form, answer) => {
  const card = form.closest(".card");
  if (answer.head === undefined) return;
  card.querySelector(".card-head").innerHTML = answer.head;
  card.querySelector(".notes").innerHTML = answer.notes;
  card.classList.remove(`edge-${card.dataset.status}`);
  card.classList.add(`edge-${answer.status}`);
  card.dataset.status = answer.status;
  form.elements.seen.value = answer.seen;
  form.querySelector("[value=remove]").hidden = !answer.decided;
  form.querySelector("[value=undo]").hidden = !answer.together;
  document.getElementById("total").textContent = answer.total;
};

const send = async (form, submitter) => {
  if (form.dataset.busy) return;
  const before = typed(form);
  const body = new URLSearchParams(new FormData(form));
  if (submitter && submitter.name) body.set(submitter.name, submitter.value);
  form.dataset.busy = "yes";
  told(form, "saving…");
  try {
    const response = await fetch(form.action, { method: "POST", body, headers: { "X-Asked-By": "script" } });
    const answer = await response.json();
    put(form, answer);
    if (!response.ok) {
      told(form, answer.error || "not saved", true);
      form.closest(".card")?.querySelector(".notes").scrollIntoView({ block: "nearest" });
      return;
    }
    const gone = ["remove", "undo"].includes(body.get("do"));
    if (gone && typed(form) === before) {
      form.querySelectorAll("input[type=text], textarea").forEach((field) => { field.value = ""; });
      form.querySelectorAll("input[type=checkbox]").forEach((field) => { field.checked = false; });
    }
    if (gone || typed(form) === before) settle(form);
    told(form, answer.said);
    if (answer.author !== undefined) document.querySelector(".author").textContent = answer.author || "no name";
    const anew = document.getElementById("anew");
    if (anew && answer.head !== undefined) anew.hidden = false;
    if (answer.go && !unsaved().length) window.location.assign(answer.go);
  } catch (error) {
    told(form, "not saved: the review does not answer; is it still running in the terminal?", true);
  } finally {
    delete form.dataset.busy;
  }
};

document.addEventListener("submit", (event) => {
  if (event.target.method !== "post" || "plain" in event.target.dataset) return;
  event.preventDefault();
  send(event.target, event.submitter);
});

const look = (form) => {
  const changed = typed(form) !== form.dataset.at;
  form.classList.toggle("unsaved", changed);
  told(form, changed ? "not saved yet" : "");
};

document.addEventListener("input", (event) => {
  const form = event.target.closest("form.decide");
  if (form) look(form);
});

window.addEventListener("beforeunload", (event) => {
  if (unsaved().length) event.preventDefault();
});

const step = (by) => {
  const rows = [...document.querySelectorAll("a.row")];
  const at = rows.indexOf(document.activeElement);
  const to = rows[at < 0 ? 0 : at + by];
  const link = document.getElementById(by > 0 ? "after" : "before");
  if (to) to.focus();
  else if (rows.length && link) window.location.assign(link.href + (by > 0 ? "#first" : "#last"));
  else if (link) link.click();
};

const STEPS = { j: 1, ArrowRight: 1, k: -1, ArrowLeft: -1 };

document.addEventListener("keydown", (event) => {
  const field = event.target.closest("input:not([type=checkbox]), textarea, select");
  if (field && event.key === "Escape") field.blur();
  if (field && event.key === "Enter" && (event.ctrlKey || event.metaKey) && field.form) field.form.requestSubmit(field.form.querySelector("[value=save]"));
  if (field || event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
  const help = document.getElementById("keys");
  if (event.key === "?" && !help.open) help.showModal();
  if (event.shiftKey || help?.open) return;
  const listing = document.body.classList.contains("listing");
  const by = STEPS[event.key] || (listing && { ArrowDown: 1, ArrowUp: -1 }[event.key]);
  if (by) {
    event.preventDefault();
    step(by);
  }
  const on = document.body.classList.contains("by-criterion") && document.querySelector("form.decide [value=next]");
  if (event.key === "Enter" && on && !event.target.closest("a, button, summary")) {
    event.preventDefault();
    on.form.requestSubmit(on);
  }
  const comment = /^[1-9]$/.test(event.key) && document.querySelectorAll("form.decide")[0]?.querySelectorAll("[name=bank]")[event.key - 1];
  if (comment) comment.click();
  if (event.key === "e") {
    const first = document.querySelector(".decisions form.decide input[type=text]");
    if (first && first.offsetParent) {
      event.preventDefault();
      first.focus();
      first.select();
    }
  }
});

document.querySelectorAll("form.decide").forEach((form) => {
  form.dataset.at = written(form);
  if (typed(form) !== form.dataset.at) look(form); // typed before this script came
});
const edge = { "#first": 0, "#last": -1 }[window.location.hash];
if (edge !== undefined) [...document.querySelectorAll("a.row")].at(edge)?.focus();
document.getElementById("anew")?.addEventListener("click", (event) => {
  event.target.hidden = true;
  const frame = document.getElementById("report");
  if (frame) frame.src = frame.getAttribute("src");
});
