"use strict";
(function () {
  const PAGE = 100;
  const REPORT = "/report.html";
  const SIGNS = { p: "✓", a: "◐", f: "✗", b: "⊘", i: "?", e: "!", m: "•", n: "" };
  const WORDS = {
    p: "passed", a: "partly to fix", f: "to fix", b: "not tested", i: "not decided yet",
    e: "not decided yet, the check broke", m: "waits for a person", n: "not judged",
  };
  const STATES = {
    graded: ["graded", "pass", "✓"],
    inconclusive: ["not decided yet", "inconclusive", "?"],
    manual: ["waits for a person", "manual", "•"],
    error: ["could not be graded", "error", "!"],
    missing: ["not graded yet", "blocked", "–"],
  };
  const data = JSON.parse(document.getElementById("data").textContent);
  const criteria = data.criteria.map(([id, title, most]) => ({ id, title, most }));
  const rows = data.rows.map(read);
  const find = (id) => document.getElementById(id);
  const collator = new Intl.Collator(undefined, { numeric: true, sensitivity: "base" });

  const table = find("submissions");
  const heads = [...table.tHead.rows[0].cells];
  const columns = heads.map((head) => head.dataset.column);
  const sorting = { column: null, down: false };
  let picked = null;
  let shown = rows;
  let page = 0;

  function read(row, place) {
    const [id, name, group, link, state, points, letters, earned, late, decided, time] = row;
    return {
      place, id, name, group, state, points, letters, earned: earned || {}, late, time,
      link: link === 1 ? id + REPORT : link || "",
      decided: decided ? decided[0] : 0,
      again: decided ? decided[1] : 0,
      found: [id, name, group].join("\n").toLowerCase(),
      reached: letters.split("p").length - 1,
    };
  }

  function make(tag, text, className) {
    const element = document.createElement(tag);
    if (text !== undefined) { element.textContent = text; }
    if (className) { element.className = className; }
    return element;
  }

  function short(value) {
    return String(Math.round(value * 1000) / 1000);
  }

  function span(seconds) {
    if (seconds < 59.5) { return (seconds < 9.95 ? seconds.toFixed(1) : seconds.toFixed(0)) + " s"; }
    const whole = Math.round(seconds);
    const units = [[86400, "d", 3600, "h"], [3600, "h", 60, "min"], [60, "min", 1, "s"]];
    const [size, unit, part, smaller] = units.find((one) => whole >= one[0]);
    const rest = Math.floor((whole % size) / part);
    return Math.floor(whole / size) + " " + unit + (rest ? " " + rest + " " + smaller : "");
  }

  function judged(row) {
    return row.state !== "error" && row.state !== "missing";
  }

  function lost(row, place) {
    return judged(row) && "afb".includes(row.letters[place]);
  }

  function earned(row, place) {
    const letter = row.letters[place];
    return row.earned[place] ?? (letter === "p" ? criteria[place].most : 0);
  }

  function named(row) {
    const element = row.link ? make("a", row.id) : make("bdi", row.id);
    if (row.link) { element.href = row.link; }
    return element;
  }

  // The table

  const cells = {
    id(row) {
      const cell = make("th");
      cell.scope = "row";
      cell.append(named(row));
      return cell;
    },
    name: (row) => make("td", row.name, "words"),
    group: (row) => make("td", row.group),
    points: (row) => make("td", judged(row) ? short(row.points) : "–", "number"),
    letters(row) {
      const cell = make("td");
      if (!judged(row)) { return cell; }
      const strip = make("span", undefined, "strip");
      strip.setAttribute("role", "img");
      const open = criteria.filter((_, place) => lost(row, place)).map((one) => one.title);
      strip.setAttribute(
        "aria-label",
        row.reached + " of " + criteria.length + " reached" + (open.length ? ", lost: " + open.join(", ") : "")
      );
      [...row.letters].forEach((letter, place) => {
        const sign = make("span", SIGNS[letter], "sign s-" + letter);
        sign.title = criteria[place].title + ": " + WORDS[letter];
        strip.append(sign);
      });
      cell.append(strip);
      return cell;
    },
    state(row) {
      const cell = make("td");
      const [words, colour, sign] = STATES[row.state];
      cell.append(make("span", sign + " " + words, "badge status-" + colour));
      return cell;
    },
    late: (row) => make("td", row.late > 0 ? span(row.late) : ""),
    decided(row) {
      const words = row.decided ? row.decided + (row.again ? ", look again" : "") : "";
      return make("td", words);
    },
    time: (row) => make("td", row.time ? span(row.time) : "", "number"),
  };

  const keys = {
    points: (row) => (judged(row) ? row.points : -1),
    letters: (row) => (judged(row) ? row.reached : -1),
    state: (row) => Object.keys(STATES).indexOf(row.state),
    late: (row) => row.late,
    decided: (row) => row.decided + row.again / 1000,
    time: (row) => row.time,
  };

  function sorted(list) {
    if (!sorting.column) { return list; }
    const key = keys[sorting.column];
    const sign = sorting.down ? -1 : 1;
    const compare = key
      ? (one, other) => key(one) - key(other)
      : (one, other) => collator.compare(one[sorting.column], other[sorting.column]);
    return [...list].sort((one, other) => sign * compare(one, other) || one.place - other.place);
  }

  function sortBy(column) {
    const down = sorting.column === column ? !sorting.down : column in keys && column !== "state";
    Object.assign(sorting, { column, down });
    heads.forEach((head) => {
      const own = head.dataset.column === column;
      if (own) { head.setAttribute("aria-sort", down ? "descending" : "ascending"); }
      else { head.removeAttribute("aria-sort"); }
    });
    update();
  }

  const text = find("filter-text");
  const state = find("filter-state");
  const lostBy = find("filter-lost");
  const mark = find("filter-mark");
  const marks = { late: (row) => row.late > 0, decided: (row) => row.decided, again: (row) => row.again };

  function filtered() {
    const words = text.value.toLowerCase().split(/\s+/).filter(Boolean);
    return rows.filter((row) =>
      words.every((word) => row.found.includes(word)) &&
      (!state.value || row.state === state.value) &&
      (lostBy.value === "" || lost(row, Number(lostBy.value))) &&
      (!mark || !mark.value || marks[mark.value](row)) &&
      (!picked || picked.places.has(row.place))
    );
  }

  function update() {
    shown = sorted(filtered());
    page = 0;
    draw();
  }

  function draw() {
    const pages = Math.max(1, Math.ceil(shown.length / PAGE));
    const part = shown.slice(page * PAGE, (page + 1) * PAGE);
    const body = document.createDocumentFragment();
    part.forEach((row) => {
      const line = make("tr");
      line.dataset.id = row.id;
      columns.forEach((column) => line.append(cells[column](row)));
      body.append(line);
    });
    table.tBodies[0].replaceChildren(body);
    find("shown").textContent = shown.length === rows.length
      ? rows.length + (rows.length === 1 ? " submission" : " submissions")
      : shown.length + " of " + rows.length + " submissions";
    find("pages").hidden = pages === 1;
    find("page-said").textContent = "Page " + (page + 1) + " of " + pages;
    find("page-before").disabled = page === 0;
    find("page-next").disabled = page === pages - 1;
  }

  function turn(by) {
    page += by;
    draw();
    table.scrollIntoView();
  }

  // What is picked elsewhere on the page

  function pick(words, places) {
    [text, state, lostBy, mark].forEach((field) => { if (field) { field.value = ""; } });
    picked = places && { places: new Set(places) };
    find("picked").hidden = !picked;
    find("picked").firstElementChild.textContent = words;
    update();
  }

  function goToTable() {
    find("table").scrollIntoView();
    find("filter-text").focus({ preventScroll: true });
  }

  function openMembers(details) {
    const place = details.querySelector(".members");
    if (!details.open || place.childElementCount) { return; }
    data.diagnoses[details.dataset.diagnosis].forEach((member) => {
      const row = rows[member];
      const one = make("span");
      one.append(named(row), row.name ? " " + row.name : "");
      place.append(one, " ");
    });
    const form = details.querySelector("form");
    if (form) { form.hidden = false; }
  }

  // What `overrides.yaml` takes (JSON is YAML): the comment, and where people awarded points these too
  function commented(form) {
    const place = criteria.findIndex((one) => one.id === form.dataset.criterion);
    const comment = JSON.stringify(form.querySelector("textarea").value);
    return data.diagnoses[form.dataset.comment].map((member) => {
      const row = rows[member];
      const points = row.decided ? "points: " + short(earned(row, place)) + ", " : "";
      const key = JSON.stringify(form.dataset.criterion);
      return JSON.stringify(row.id) + ":\n  " + key + ": {" + points + "comment: " + comment + "}\n";
    }).join("");
  }

  function copyComment(event) {
    event.preventDefault();
    const button = event.target.querySelector("button");
    const area = event.target.querySelector("textarea");
    const kept = area.value;
    const said = (done) => { find("copied").textContent = button.textContent = done ? "Copied" : "It could not be copied"; };
    if (navigator.clipboard) {
      navigator.clipboard.writeText(commented(event.target)).then(() => said(true), () => said(false));
      return;
    }
    area.value = commented(event.target);
    area.select();
    said(document.execCommand("copy"));
    area.value = kept;
  }

  // The heat map

  function heatMap(frame) {
    const drawing = frame.querySelector("svg");
    const scroll = find("heat-scroll");
    const step = Number(frame.dataset.step);
    const height = Number(frame.dataset.row);
    const cursor = document.createElementNS("http://www.w3.org/2000/svg", "rect");
    const at = { column: 0, row: 0 };
    cursor.setAttribute("class", "cursor");
    cursor.setAttribute("width", step);
    cursor.setAttribute("height", height);

    function words() {
      const members = data.heat[at.column].map((place) => rows[place]);
      const criterion = data.heatRows[at.row];
      const title = criteria[criterion].title;
      if (members.length > 1) {
        const many = members.filter((row) => lost(row, criterion)).length;
        const [high, low] = [members[0].points, members[members.length - 1].points];
        const range = high === low ? short(high) : short(low) + " to " + short(high);
        return members.length + " submissions with " + range + " points — " + title + ": " + many + " lost points";
      }
      const [row] = members;
      const letter = row.letters[criterion];
      const points = short(earned(row, criterion)) + " of " + short(criteria[criterion].most);
      const who = row.name ? row.id + " (" + row.name + ")" : row.id;
      return who + ", " + short(row.points) + " points — " + title + ": " + SIGNS[letter] + " " + WORDS[letter] + ", " + points;
    }

    function go(column, row) {
      at.column = Math.min(data.heat.length - 1, Math.max(0, column));
      at.row = Math.min(criteria.length - 1, Math.max(0, row));
      cursor.setAttribute("x", at.column * step);
      cursor.setAttribute("y", at.row * height - 1);
      drawing.append(cursor);
      find("heat-said").textContent = words();
    }

    function point(event) {
      const box = drawing.getBoundingClientRect();
      go(Math.floor((event.clientX - box.left) / step), Math.floor((event.clientY - box.top) / height));
    }

    function show() {
      const places = data.heat[at.column];
      const words = places.length === 1 ? "Picked in the heat map." : places.length + " picked in the heat map.";
      pick(words, places);
      goToTable();
    }

    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    scroll.addEventListener("keydown", (event) => {
      const move = moves[event.key];
      if (event.key === "Enter") { show(); }
      if (!move) { return; }
      event.preventDefault();
      go(at.column + (cursor.isConnected ? move[0] : 0), at.row + (cursor.isConnected ? move[1] : 0));
      const x = at.column * step;
      if (x < scroll.scrollLeft || x + step > scroll.scrollLeft + scroll.clientWidth) {
        scroll.scrollLeft = x - scroll.clientWidth / 2;
      }
    });
    drawing.addEventListener("pointermove", point);
    drawing.addEventListener("pointerdown", point);
    drawing.addEventListener("dblclick", show);
  }

  heads.forEach((head) => {
    head.firstElementChild.addEventListener("click", () => sortBy(head.dataset.column));
  });
  const showAll = () => pick("", null);
  find("filters").addEventListener("input", update);
  find("show-all").addEventListener("click", showAll);
  find("picked").lastElementChild.addEventListener("click", showAll);
  find("page-before").addEventListener("click", () => turn(-1));
  find("page-next").addEventListener("click", () => turn(1));
  document.querySelectorAll("details[data-diagnosis]").forEach((details) => {
    details.addEventListener("toggle", () => openMembers(details));
  });
  document.querySelectorAll("[data-diagnosis-show]").forEach((button) => {
    const what = button.closest("details").querySelector(".what");
    button.addEventListener("click", () => {
      pick(what.textContent.replace(/\s+/g, " ").trim(), data.diagnoses[button.dataset.diagnosisShow]);
      goToTable();
    });
  });
  document.querySelectorAll("[data-cost-show]").forEach((button) => {
    const place = Number(button.dataset.costShow);
    button.addEventListener("click", () => {
      pick("Lost points by: " + criteria[place].title, data.costs[place]);
      goToTable();
    });
  });
  document.querySelectorAll("[data-comment]").forEach((form) => form.addEventListener("submit", copyComment));
  document.querySelectorAll(".heat").forEach(heatMap);
  find("filters").hidden = false;
  table.hidden = false;
  update();
})();
