"""`grader rubric new`: a correct package is run twice, and a rubric that asks for what was observed is proposed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath

from grader import pipeline
from grader.authoring import rubric_draft
from grader.authoring.rubric_draft import Observed, Parts, RubricEntry, Topic
from grader.checks.build import judge_build
from grader.checks.package_files import RUNTIME_KINDS
from grader.checks.stamps import StampsParams
from grader.checks.stamps import stamps as judge_stamps
from grader.checks.support.topics import TF_TOPICS
from grader.errors import RosMissing, SubmissionError
from grader.evidence.reader import load_evidence, package_facts
from grader.evidence.run import Run
from grader.files import temporary_folder
from grader.intake.open import open_submission
from grader.model.package import Interface, PackageFacts
from grader.model.result import Progress
from grader.model.verdict import Status
from grader.package.facts import read_package
from grader.rubric.consistency import TOTAL_POINTS
from grader.rubric.load import LoadedRubric

WEIGHTS = {
    "manifest": 1, "cmake": 1, "build": 1, "executable": 1, "node-lives": 1, "node-name": 1, "topic-type": 2, "rate": 3,
    "counter-start": 1, "counter-step": 1, "counter-wrap": 3, "message": 1, "hears": 2, "service": 2, "latched": 1,
    "cmake-install": 2, "launch-xml": 2, "launch-runs": 2, "reacts": 2, "definition": 1, "service-answers": 3,
    "calls": 2, "prints": 2, "stamps": 2,
}  # fmt: skip
WINDOW_S = 6
WRAPS = 2
LIVES_S = 5
QUICK_S, QUICK_LIMIT_S, NS = 0.5, 2, 1_000_000_000
"""A service that answers within so many seconds is given so many."""
OF_THE_COURSE = "A package of the course's goes into one folder with it: --from FOLDER --package NAME"


class Proposal:
    """The rubric that asks for what a correct package was seen to do. `notes` are for the author: what was seen and is
    not covered."""

    def __init__(
        self, facts: PackageFacts, parts: Parts, seen: Mapping[str, Observed], runs: Mapping[str, Run]
    ) -> None:
        self.notes: list[str] = []
        self.scenarios: dict[str, RubricEntry] = {}
        self.criteria: list[RubricEntry] = []
        self._facts, self._parts, self._seen, self._runs = facts, parts, seen, runs
        self._files()
        build = runs.get("package")
        if build and build.processes and (built := judge_build(facts, build)).status is not Status.PASS:
            self.notes.append(f"little of the package was seen: {built.message}. {OF_THE_COURSE}")
        for name, script in parts.nodes.items():
            self._node(name, script, seen[name])
        for name, launch in parts.launches.items():
            self._launch(name, launch, seen[name])
        assign_points(self.criteria)

    def _add(self, id_: str, title: str, check: str, parameters: RubricEntry, **more: object) -> str:
        """Add a criterion without points and return its id, numbered where it is taken."""
        taken = {c["id"] for c in self.criteria}
        name = next(n for n in (id_, *(f"{id_}-{i}" for i in range(2, 100))) if n not in taken)
        entry = {"id": name, "title": title, "points": 0, "check": check}
        self.criteria.append(
            entry | ({"with": parameters} if parameters else {}) | {k: v for k, v in more.items() if v}
        )
        return name

    def _files(self) -> None:
        facts = self._facts
        declared = facts.manifest.dependencies if facts.manifest else ()
        names = list(dict.fromkeys(d.name for d in declared if d.kind in RUNTIME_KINDS))
        package = {"name": facts.name}
        self._add(
            "manifest", "The manifest names the package and what it needs", "manifest",
            package | ({"dependencies": names} if names else {}), reproduce="cat package.xml",
        )  # fmt: skip
        title = "CMakeLists.txt makes it a catkin package"
        self._add("cmake", title, "cmake", package, reproduce="cat CMakeLists.txt")
        if installed := self._installed_scripts():
            title, parameters = "CMake installs the scripts", {"scripts": installed}
            self._add("cmake-install", title, "cmake-install", parameters, requires=["cmake"])
        for one in facts.interfaces:
            self._definition(one)
        before = ["manifest", "cmake"]
        self._add("build", "The package builds", "build", {}, requires=before, reproduce="catkin_make")

    def _definition(self, one: Interface) -> None:
        """Ask for a message, service or action of the package's own, with all of its fields and constants."""
        fields = {field.path: field.type for field in one.fields if field.value is None}
        constants = {field.path: field.value for field in one.fields if field.value is not None}
        about = {"fields": fields, "constants": constants, "ordered": len(fields) > 1}
        parameters = {"file": one.path, **{key: value for key, value in about.items() if value}}
        if one.fault is None and (fields or constants):
            title = f"{one.path} is as in the handout"
            self._add(f"{label_of(PurePosixPath(one.path).stem)}-definition", title, "definition", parameters)

    def _installed_scripts(self) -> list[str]:
        calls = self._facts.cmake.calls if self._facts.cmake else ()
        named = {PurePosixPath(a).name for c in calls if c.name == "catkin_install_python" for a in c.args}
        return [s for s in self._parts.nodes.values() if PurePosixPath(s).name in named]

    def _node(self, name: str, script: str, seen: Observed) -> None:
        file = PurePosixPath(script).name
        requires: list[str] = []
        # One that is installed needs no executable bit.
        if script.endswith(".py") and script not in self._installed_scripts():
            requires = [
                self._add(
                    f"{name}-executable", f"{file} can be run", "executable", {"path": script},
                    reproduce=f"ls -lF {PurePosixPath(script).parent}"
                )
            ]  # fmt: skip
        if seen.failed or not seen.nodes:
            why = seen.failed or "no node was registered"
            needs = "" if "No module named" in why else ": does it need parameters or another node?"
            if f"; '{PurePosixPath(script).stem}' is not a package" in why:
                needs = ": the script has the package's name, and Python finds it first. Give it another one"
            self.notes.append(f"{script} was not observed ({why}){needs}")
            return
        if served := self._runs.get(f"{name}-served"):
            self._client(name, file, served, requires)
            return
        self._scenario(name, seen)
        node = self._life(name, script, seen, requires)
        for topic in seen.topics:
            self._topic(name, topic, node, self._runs.get(f"{name}-fast"))
        self._words(name, file, seen, node)
        for service, kind in seen.services.items():
            if kind:
                id_, parameters = f"service-{label_of(service)}", {"service": service, "type": kind}
                title = f"{service} is offered"
                self._add(id_, title, "service", parameters, scenario=name, requires=[node])
                self._called(name, service, kind, id_)
        self._hearing(name, script, seen, requires)

    def _called(self, name: str, service: str, kind: str, requires: str) -> None:
        """Ask for what a service was seen to answer."""
        scenario = f"{name}-asked"
        run = self._runs.get(scenario)
        actors = run.actors if run else ()
        answers = [e.value for _, e in actors if (e.action, e.topic) == ("answer", service)]
        if not answers or None in answers:
            call = f"- call: {{service: {service}, type: {kind}, request: {self._request(kind)}}}"
            self.notes.append(f"what {service} answers is not covered: a step can call it, {call}")
            return
        calls = rubric_draft.calls_of(self._seen[name], self._facts.interfaces)
        times_ns = [t for t, e in run.actors if e.action in {"call", "answer"}] if run else []
        waits_ns = (end - begin for begin, end in zip(times_ns[::2], times_ns[1::2], strict=False))
        if max(waits_ns, default=0) < QUICK_S * NS:
            # a service that sleeps is not waited for as long as one that computes
            calls = [call | {"limit_s": QUICK_LIMIT_S} for call in calls]
        self.scenarios[scenario] = rubric_draft.start_alone(
            self._parts, name, rubric_draft.ASKED, calls=calls, until={"nodes": 1}
        )
        parameters = {"service": service, "expect": list(map(rubric_draft.plain_fields, answers))}
        if len(answers) > 1 and all(answer == answers[0] for answer in answers):
            self.notes.append(
                f"{service} answers all calls alike: give them requests with answers of their own"
            )
        title = f"{service} answers as it should"
        id_ = f"answers-{label_of(service)}"
        self._add(id_, title, "service-answers", parameters, scenario=scenario, requires=[requires])

    def _client(self, name: str, file: str, run: Run, requires: list[str]) -> None:
        """Ask for what a program asks of a service of the package's, and prints of its answer."""
        scenario, serves = f"{name}-served", rubric_draft.serves_of(name, self._seen, self._facts.interfaces)
        self.scenarios[scenario] = rubric_draft.start_alone(
            self._parts, name, rubric_draft.ANSWERED, serves=serves, until={"quiet_s": 2}
        )
        for served in serves:
            service, answer = served["service"], served["answer"]
            asked = [e.value["request"] for _, e in run.actors if (e.action, e.topic) == ("serve", service)]
            if not asked:
                self.notes.append(f"{file} looked for {service} and did not call it, which is not covered")
                continue
            parameters: RubricEntry = {
                "service": service,
                "expect": list(map(rubric_draft.plain_fields, asked)),
            }
            title, id_ = f"{file} calls {service}", f"{name}-calls-{label_of(service)}"
            needs: RubricEntry = {"scenario": scenario, "requires": requires}
            calls = self._add(id_, title, "calls", parameters, **needs)
            if printed := rubric_draft.printed_answer(run, answer):
                needs["requires"] = [calls]
                title = f"{file} prints the answer"
                self._add(f"{name}-prints", title, "prints", {"process": name, **printed}, **needs)

    def _request(self, kind: str) -> str:
        """Return a request of a service of the package's own, as it can be written in a step."""
        path = f"srv/{kind.rpartition('/')[2]}.srv"
        own = (field for one in self._facts.interfaces if one.path == path for field in one.fields)
        return f"{{{', '.join(f'{field.name}: …' for field in own if field.part == 'request')}}}"

    def _words(self, name: str, file: str, seen: Observed, node: str) -> None:
        """Ask for what it logs and which parameters it shows."""
        needs: RubricEntry = {"scenario": name, "requires": [node]}
        for text in seen.logged[:1] if not seen.topics else ():
            self._add(f"{name}-logs", f"{file} logs {text!r}", "logs", {"text": text}, **needs)
        if seen.read:
            names = {"names": list(seen.read)}
            self._add(f"{name}-reads", f"{file} shows the parameters", "params-read", names, **needs)

    def _scenario(self, name: str, seen: Observed) -> None:
        periodic = [t.name for t in seen.topics if t.rate_hz]
        until: RubricEntry = (
            {"window_s": WINDOW_S, "topics": periodic} if periodic else {"alive_s": LIVES_S + 1}
        )
        if seen.ended:
            until = {"quiet_s": 2}
        self.scenarios[name] = rubric_draft.start_alone(self._parts, name, " in real time", until=until)

    def _life(self, name: str, script: str, seen: Observed, requires: list[str]) -> str:
        anonymous = "required" if seen.anonymous else "allowed"
        named: RubricEntry = {"names": list(seen.nodes[:1]), "anonymous": anonymous}
        run = f"rosrun {self._facts.name} {PurePosixPath(script).name}"
        check, title, parameters = "node-name", f"The node is /{seen.nodes[0]}", named
        if not seen.ended:
            check, title = "node-lives", f"/{seen.nodes[0]} stays alive and ends on Ctrl-C"
            parameters = {"process": name, "min_s": LIVES_S, **named}
        needs: RubricEntry = {"scenario": name, "requires": requires}
        return self._add(f"{name}-node", title, check, parameters, **needs, reproduce=run)

    def _topic(self, name: str, topic: Topic, node: str, fast: Run | None) -> None:
        label = self._label(name, topic)
        answered = any(topic.name in self._answers(name, heard) for heard in self._seen[name].listens)
        if topic.silent and not answered:
            self.notes.append(
                f"no message came on {topic.name}, which is not covered: what makes the node publish? A step can "
                "publish, call a service, set a parameter, or type a line on the node's standard input"
            )
            return
        kind = self._add(
            label,
            f"{topic.name} carries {topic.type}",
            "topic-type",
            {"topic": topic.name, "type": topic.type},
            scenario=f"{name}-answers" if topic.silent else name,
            requires=[node],
            reproduce=f"rostopic info {topic.name}",
        )
        needs: RubricEntry = {"scenario": name, "requires": [kind, node]}
        if topic.rate_hz:
            parameters: RubricEntry = {
                "topic": topic.name,
                "rate_hz": rubric_draft.format_number(topic.rate_hz),
            }
            hz = f"{topic.name} runs at {topic.rate_hz:g} Hz"
            self._add(f"{label}-rate", hz, "rate", parameters, **needs, reproduce=f"rostopic hz {topic.name}")
        stamped = {"topic": topic.name}
        run = self._runs.get(name)
        if run and judge_stamps(self._facts, run, StampsParams.model_validate(stamped)).status is Status.PASS:
            title = f"The messages on {topic.name} say when they were sent"
            self._add(f"{label}-stamps", title, "stamps", stamped, **needs)
        if topic.latched:
            title = f"{topic.name} is latched"
            self._add(f"{label}-latched", title, "latched", {"topic": topic.name}, **needs)
        if topic.template:
            parameters = {"topic": topic.name, "template": topic.template}
            title = f"The messages on {topic.name} tell the time"
            self._add(f"{label}-message", title, "message", parameters, **needs)
        if topic.counts_from is not None:
            self._counter(name, topic, [kind, node], fast)

    def _label(self, name: str, topic: Topic) -> str:
        """Return a label by the topic, and by the node too where several publish on it."""
        publishers = [n for n in self._parts.nodes if topic.name in {t.name for t in self._seen[n].topics}]
        return label_of(topic.name) if len(publishers) == 1 else f"{name}-{label_of(topic.name)}"

    def _counter(self, name: str, topic: Topic, requires: list[str], fast: Run | None) -> None:
        label, about = self._label(name, topic), {"topic": topic.name}
        wrap = rubric_draft.wraps_of(fast, topic.name) if fast else None
        rate: RubricEntry = {"rate_hz": rubric_draft.format_number(topic.rate_hz)} if topic.rate_hz else {}
        needs: RubricEntry = {"scenario": name, "requires": requires}
        if wrap:
            last, first = wrap
            words = f" with a fast clock, {WRAPS} times around"
            until = {"messages": {topic.name: WRAPS * (last - first + 1) + 2}}
            self.scenarios[f"{name}-fast"] = rubric_draft.start_alone(
                self._parts, name, words, clock="warped", until=until
            )
            needs["scenario"] = f"{name}-fast"
        title, start = f"The counter begins with {topic.counts_from}", {**about, "start": topic.counts_from}
        self._add(f"{label}-start", title, "counter-start", start, **needs)
        step = {**about, "maximum": wrap[0] if wrap else 2**31 - 1, **rate}
        self._add(f"{label}-step", "The counter goes up by one", "counter-step", step, **needs)
        if wrap:
            parameters = {**about, "minimum": wrap[1], "maximum": wrap[0], "wraps": WRAPS, **rate}
            title = f"After {wrap[0]} comes {wrap[1]}"
            self._add(f"{label}-wrap", title, "counter-wrap", parameters, **needs)

    def _hearing(self, name: str, script: str, seen: Observed, requires: list[str]) -> None:
        run = self._runs.get(f"{name}-hears")
        found = {t: k for t, k in seen.listens.items() if run and rubric_draft.probe_for(t, k)}
        heard = {t: template for t in found if run and (template := rubric_draft.heard_template(run, t))}
        self._answering(name, script, {t: k for t, k in seen.listens.items() if t not in heard}, requires)
        if not heard:
            return
        scenario = f"{name}-hears"
        probes = [rubric_draft.probe_for(topic, found[topic]) for topic in heard]
        self.scenarios[scenario] = rubric_draft.start_alone(
            self._parts, name, rubric_draft.MADE_UP, probes=probes, until={"heard": True}
        )
        for topic, template in heard.items():
            parameters = {"topic": topic} | ({"template": template} if template != "{value}" else {})
            id_ = f"{name}-hears-{label_of(topic)}"
            title = f"{PurePosixPath(script).name} prints what it hears on {topic}"
            self._add(id_, title, "hears", parameters, scenario=scenario, requires=requires)

    def _answers(self, name: str, topic: str) -> set[str]:
        """Return the topics on which a node was seen to answer what it heard on one."""
        run = self._runs.get(f"{name}-answers")
        periodic = {one.name for one in self._seen[name].topics if one.rate_hz}
        return set(rubric_draft.answers_to(run, topic, rubric_draft.ANSWERS_S)) - periodic if run else set()

    def _answering(self, name: str, script: str, listens: Mapping[str, str], requires: list[str]) -> None:
        """Ask for what it publishes upon what it hears and does not print."""
        scenario, steps = f"{name}-answers", []
        for topic, kind in listens.items():
            found = self._answers(name, topic)
            if not found and topic in TF_TOPICS:
                frames = (
                    "{parent: map, child: base_link, translation: [{from: 0, to: 1}, 0, 0], duration_s: 2}"
                )
                words = f"{script} listens to /tf, which is not covered: a step can send transforms, "
                self.notes.extend({f"{words}- transform: {frames}"} - {*self.notes})
                continue
            if not found:
                step = rubric_draft.step_for(topic, kind)["publish"]
                words = f"{script} listens to {topic} ({kind}), which is not covered: a step can send it something, "
                self.notes.append(f"{words}- publish: {rubric_draft.dump_flow(step)}")
                continue
            steps.append(rubric_draft.step_for(topic, kind))
            for answer in sorted(found):
                parameters = {
                    "cause": {"topic": topic},
                    "effect": {"topic": answer},
                    "within_s": rubric_draft.ANSWERS_S,
                }
                id_ = f"{name}-answers-{label_of(topic)}-{label_of(answer)}"
                title = f"{PurePosixPath(script).name} publishes on {answer} after each message on {topic}"
                self._add(id_, title, "reacts", parameters, scenario=scenario, requires=requires)
        if steps:
            self.scenarios[scenario] = rubric_draft.start_alone(
                self._parts, name, rubric_draft.SENT, steps=[*steps, rubric_draft.WAIT]
            )

    def _launch(self, name: str, launch: str, seen: Observed) -> None:
        file = next(f for f in self._facts.launch_files if PurePosixPath(f.path).name == launch)
        own = {n.type for n in file.nodes if n.pkg == self._facts.name}
        others = [n for n in file.nodes if n.pkg != self._facts.name and n.pkg and n.type and n.name]
        wanted: RubricEntry = {"launch": launch}
        wanted |= drop_empty(scripts=[s for s in self._parts.nodes.values() if PurePosixPath(s).name in own])
        programs = drop_empty(programs=[f"{n.pkg}/{n.type}" for n in others])
        if not seen.nodes:
            self.notes.append(
                f"{launch} brought up no node ({seen.failed or 'none registered'}): not covered"
            )
            return
        xml = self._add(
            f"{name}-xml", f"{launch} is well-formed and names its nodes", "launch-xml", wanted | programs
        )
        until: RubricEntry = {"nodes": len(seen.nodes), "alive_s": 1}
        self.scenarios[name] = {
            "title": f"roslaunch {launch}",
            "start": [{"name": name, "launch": launch}],
            "until": {"connected": list(seen.connected[:1])} if seen.connected else until,
        }
        nodes = {str(n.name): str(n.pkg) for n in others}
        ours = [str(n.name) for n in file.nodes if n.pkg == self._facts.name]
        if len(ours) > len(own):  # one script is several nodes
            named_so = [one for one in sorted(seen.nodes) if one.rpartition("/")[2] in ours]
            nodes |= {f"/{one}": self._facts.name for one in named_so}
        named = {"nodes": nodes} if nodes else {}
        parameters = wanted | ({"topic": seen.connected[0]} if seen.connected else {}) | named
        self._add(
            f"{name}-runs", f"roslaunch brings up the nodes of {launch}", "launch-runs", parameters,
            scenario=name, requires=[xml], reproduce=f"roslaunch {self._facts.name} {launch}",
        )  # fmt: skip


def drop_empty(**lists: list[str]) -> RubricEntry:
    """Return the lists that are not empty."""
    return {name: items for name, items in lists.items() if items}


def assign_points(criteria: list[RubricEntry]) -> None:
    """Set each criterion's points by its check's weight: whole numbers, together 100."""
    weights = [WEIGHTS.get(c["check"], 1) for c in criteria]
    exact = [TOTAL_POINTS * w / sum(weights) for w in weights]
    for criterion, points in zip(criteria, exact, strict=True):
        criterion["points"] = int(points)
    order = sorted(range(len(exact)), key=lambda i: (int(exact[i]) - exact[i], i))
    for index in order[: TOTAL_POINTS - sum(c["points"] for c in criteria)]:
        criteria[index]["points"] += 1


def label_of(name: str) -> str:
    """Return a topic's or service's name as part of a criterion's id: letters, digits and hyphens."""
    letters: Iterator[str] = (c if c.isalnum() and c.isascii() else "-" for c in name.lower())
    label = "-".join(part for part in "".join(letters).split("-") if part)
    return label if label[:1].isalpha() else f"t-{label}"


# ---- the whole way from a package to a rubric's text


def propose_rubric(
    source: str, package: str, rubric_id: str, options: pipeline.GradeOptions, progress: Progress
) -> str:
    """Return the text of a rubric for the correct package that `source` holds.

    Raises GraderError: SubmissionError where nothing of it can be run, RosMissing without ROS.
    """
    with temporary_folder("new") as folder:
        submission = open_submission(source, package=package, workdir=folder / "source")
        facts = read_package(submission.package)
        parts = rubric_draft.find_parts(submission.package.folder, facts)
        if not parts.nodes and not parts.launches:
            raise SubmissionError(
                f"{package} has no node and no launch file", hint="name a finished solution"
            )
        runs = _record_runs(
            source, rubric_draft.first_look(package, parts), folder / "first", options, progress
        )
        seen = {name: rubric_draft.observe(runs[name]) for name in (*parts.nodes, *parts.launches)}
        again = rubric_draft.second_look(package, parts, seen, facts.interfaces)
        if again is not None:
            runs |= _record_runs(source, again, folder / "second", options, progress)
        if "package" in runs:  # with what the build said of CMakeLists.txt
            facts = package_facts(runs["package"])
        proposal = Proposal(facts, parts, seen, runs)
        return rubric_draft.rubric_text(
            package, rubric_id, proposal.scenarios, proposal.criteria, proposal.notes
        )


def _record_runs(
    source: str, rubric: LoadedRubric, out: Path, options: pipeline.GradeOptions, progress: Progress
) -> dict[str, Run]:
    """Record the rubric's runs and load them. Raises RosMissing where nothing could be run."""
    runs = load_evidence(pipeline.record(source, rubric, out, options, progress))
    missing = [name for name in rubric.rubric.scenarios if name not in runs]
    if missing:
        reason = runs["package"].metadata.get("not_run", "")
        raise RosMissing(f"nothing was run{': ' + reason if reason else ''}", hint="grader doctor")
    return runs
