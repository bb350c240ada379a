"""Each file of deploy/ is accepted by the program that it is for, and says what the daemon knows."""

import json
import os
import re
import shutil
import socket
import subprocess
import tempfile
import unittest
from pathlib import Path

import yaml

from deploy.tools import DEPLOY, PLACES, SOURCE, environment, find, run
from e2e.daemon import BUILD, Daemon

KUBERNETES = DEPLOY / "kubernetes"
# What the pod of kubernetes/hashed knows of where it is.
POD = {"NAMESPACE": "pictures", "CLUSTER_DOMAIN": "cluster.local"}


def options():
    """SHADED_ variables that the daemon reads."""
    text = subprocess.run([str(BUILD / "shaded"), "--help"], capture_output=True, text=True,
                          check=True).stdout
    names = re.findall(r"^  --([a-z-]+)", text, re.MULTILINE)
    return {"SHADED_" + name.upper().replace("-", "_") for name in names}


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)


class SystemdTest(Folder):
    def test_units_are_valid(self):
        for unit in (DEPLOY / "systemd").iterdir():
            # The daemon is not installed here.
            text = unit.read_text().replace("/usr/bin/shaded", str(BUILD / "shaded"))
            (self.folder / unit.name).write_text(text)
        names = sorted(str(path) for path in self.folder.iterdir())
        self.assertEqual(len(names), 3)
        self.assertEqual(run("systemd-analyze", "verify", "--man=no", *names), "")

    def test_exposure_is_at_most_2(self):
        # The threshold is in tenths. 0.8 when this was written.
        run("systemd-analyze", "security", "--offline=true", "--threshold=20", "--no-pager",
            DEPLOY / "systemd/shaded.service")

    def test_the_daemon_stops_before_it_is_killed(self):
        text = (DEPLOY / "systemd/shaded.service").read_text()
        drain = int(re.search(r"^drain-time = (\d+)$", (SOURCE / "config/shaded.conf").read_text(),
                              re.MULTILINE)[1])
        self.assertGreater(int(re.search(r"^TimeoutStopSec=(\d+)$", text, re.MULTILINE)[1]),
                           drain + 5)


class ProxiesTest(Folder):
    def test_haproxy_takes_its_configurations(self):
        for path in DEPLOY / "haproxy/haproxy.cfg", KUBERNETES / "hashed/haproxy.cfg":
            run("haproxy", "-c", "-f", path, **POD)

    def test_haproxy_looks_replicas_up_by_their_whole_name(self):
        """It knows no search list, by which other programs in a pod get along with less."""
        proxy = next(item for item in yaml.safe_load_all(
            (KUBERNETES / "hashed/proxy.yaml").read_text()) if item["kind"] == "Deployment")
        container = proxy["spec"]["template"]["spec"]["containers"][0]
        self.assertEqual({variable["name"] for variable in container["env"]}, set(POD))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
            server.bind(("127.0.0.1", 0))
            server.settimeout(500)
            path = self.folder / "haproxy.cfg"
            path.write_text((KUBERNETES / "hashed/haproxy.cfg").read_text()
                            .replace("parse-resolv-conf",
                                     f"nameserver fake 127.0.0.1:{server.getsockname()[1]}")
                            .replace("init-addr last,libc,none", "init-addr none")
                            .replace("bind :8080", f"bind {self.folder}/socket"))
            haproxy = subprocess.Popen([find("haproxy"), "-f", path], env={**environment(), **POD},
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            try:
                question = server.recv(1000)[12:]
            finally:
                haproxy.kill()
                haproxy.wait()
        labels = []
        while question[0]:
            labels.append(question[1:1 + question[0]].decode())
            question = question[1 + question[0]:]
        self.assertEqual(labels, ["shaded-replicas", "pictures", "svc", "cluster", "local"])

    def test_both_haproxy_configurations_differ_only_in_their_replicas(self):
        def essence(path):
            text = re.sub(r"^\s*#.*$|\s+#.*$", "", path.read_text(), flags=re.MULTILINE)
            own = r"^    (server|server-template|hold obsolete|accepted_payload_size) .*$"
            return re.sub(own, "", text, flags=re.MULTILINE).split()

        self.assertEqual(essence(DEPLOY / "haproxy/haproxy.cfg"),
                         essence(KUBERNETES / "hashed/haproxy.cfg"))

    def test_nginx_takes_its_configuration(self):
        text = (DEPLOY / "nginx/nginx.conf").read_text()
        self.assertIn("server shaded:8080 ", text)
        path = self.folder / "nginx.conf"
        # A name would be looked up; /tmp is everybody's here.
        path.write_text(text.replace(" shaded:", " 127.0.0.1:")
                        .replace("/tmp/", f"{self.folder}/"))
        run("nginx", "-t", "-c", path)

    def test_the_proxies_bodies_are_the_daemons(self):
        compose = yaml.safe_load((DEPLOY / "compose.yaml").read_text())
        body = compose["services"]["shaded"]["environment"]["SHADED_MAX_BODY"]
        self.assertIn(f"client_max_body_size {body.lower()};",
                      (DEPLOY / "nginx/nginx.conf").read_text())


class ComposeTest(unittest.TestCase):
    def test_docker_compose_takes_it(self):
        run("docker-compose", "-f", "compose.yaml", "config", "-q", cwd=DEPLOY)

    def test_its_options_and_files_exist(self):
        services = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"]
        (port,) = re.findall(r"http://127.0.0.1:(\d+)/readyz", str(services["proxy"]["healthcheck"]))
        self.assertIn(f"listen {port};", (DEPLOY / "nginx/nginx.conf").read_text())
        own = {name for name in services["shaded"]["environment"] if name.startswith("SHADED_")}
        self.assertLessEqual(own, options())
        build = services["shaded"]["build"]
        self.assertTrue((DEPLOY / build["context"] / build["dockerfile"]).is_file())
        for service in services.values():
            self.assertTrue(service["read_only"])
            self.assertEqual(service["cap_drop"], ["ALL"])
            self.assertNotEqual(service["user"].split(":")[0], "0")


class KubernetesTest(unittest.TestCase):
    def build(self, folder):
        """The overlay's objects, by kustomize."""
        if folder != "base":
            self.wants_overlays()
        return list(yaml.safe_load_all(run("kubectl", "kustomize", KUBERNETES / folder)))

    def wants_overlays(self):
        version = run("kubectl", "version", "--client", "-o", "json")
        version = json.loads(version)["clientVersion"]
        kubectl = int(version["major"]), int(version["minor"].rstrip("+"))
        if kubectl < (1, 21):
            self.skipTest(f"kubectl {kubectl[0]}.{kubectl[1]} (Debian 12's) knows no folders as "
                          "resources: only base/ is built, the overlay's YAML is checked")

    def pin(self, *words):
        """What deploy/kubernetes/pin says of itself, in a copy of that folder; and the copy."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        copy = Path(folder.name) / "kubernetes"
        shutil.copytree(KUBERNETES, copy)
        done = subprocess.run([copy / "pin", *words], env={**environment(), "PATH": PLACES},
                              capture_output=True, text=True, timeout=500, check=False)
        return done.returncode, done.stderr, copy / "pinned"

    def test_images_are_pinned_to_digests(self):
        self.wants_overlays()
        digest = "sha256:" + "0123456789abcdef" * 4
        status, text, folder = self.pin("hashed", f"shaded=host:5000/our/shaded:0.1.0@{digest}",
                                        f"haproxy=haproxy@{digest}")
        self.assertEqual((status, text), (0, ""))
        objects = list(yaml.safe_load_all(run("kubectl", "kustomize", folder)))
        self.assertEqual(sorted(pod["containers"][0]["image"] for pod in self.pods(objects)),
                         [f"haproxy@{digest}", f"host:5000/our/shaded@{digest}"])
        # Nothing else is another.
        images = r"image: .*"
        self.assertEqual(re.sub(images, "", run("kubectl", "kustomize", folder)),
                         re.sub(images, "", run("kubectl", "kustomize", KUBERNETES / "hashed")))
        status, text, folder = self.pin("hashed", f"shaded=shaded@{digest}")
        self.assertEqual(status, 1)
        self.assertIn("haproxy:lts", text)
        self.assertFalse(folder.exists())

    def test_what_names_no_digest_is_not_pinned(self):
        for words, why in ((["base", "shaded=shaded@sha256:12"], "'sha256:12' is no digest"),
                           (["nowhere", "shaded=x"], "there is no overlay 'nowhere'"),
                           (["base", "shaded"], "'shaded' is not of the form NAME=IMAGE"),
                           (["base"], "pin OVERLAY NAME=IMAGE...")):
            status, text, folder = self.pin(*words)
            self.assertEqual((status, text), (1, f"pin: {why}\n"))
            self.assertFalse(folder.exists())

    def pods(self, objects):
        return [item["spec"]["template"]["spec"] for item in objects
                if item["kind"] == "Deployment"]

    def test_base_is_built_and_complete(self):
        objects = self.build("base")
        kinds = {item["kind"] for item in objects}
        self.assertEqual(kinds, {"ServiceAccount", "Deployment", "Service", "NetworkPolicy",
                                 "HorizontalPodAutoscaler", "PodDisruptionBudget"})
        self.confined(objects)

    def test_hashed_is_built(self):
        objects = self.build("hashed")
        self.assertEqual(len(self.pods(objects)), 2)
        self.confined(objects)
        maps = [item for item in objects if item["kind"] == "ConfigMap"]
        self.assertIn("haproxy.cfg", maps[0]["data"])

    def test_monitored_has_a_monitor_of_each_deployment(self):
        """Whose ports are those of its pods."""
        self.build("monitored")
        monitors = {item["metadata"]["name"]: item["spec"] for item in yaml.safe_load_all(
            (KUBERNETES / "monitored/monitors.yaml").read_text())}
        self.assertEqual(set(monitors), {"shaded", "shaded-proxy"})
        for monitor in monitors.values():
            self.assertEqual([(end["port"], end["path"])
                              for end in monitor["podMetricsEndpoints"]], [("admin", "/metrics")])
        for path in "base/deployment.yaml", "hashed/proxy.yaml":
            (pod,) = [item["spec"]["template"]["spec"]
                      for item in yaml.safe_load_all((KUBERNETES / path).read_text())
                      if item["kind"] == "Deployment"]
            self.assertIn("admin", {port["name"] for port in pod["containers"][0]["ports"]})

    def test_confined_is_built_with_the_profile(self):
        (pod,) = self.pods(self.build("confined"))
        profile = pod["containers"][0]["securityContext"]["seccompProfile"]
        self.assertEqual(profile, {"type": "Localhost",
                                   "localhostProfile": "profiles/shaded.json"})

    def test_kept_mounts_its_claim_where_the_option_says(self):
        claim = yaml.safe_load((KUBERNETES / "kept/claim.yaml").read_text())
        pod = yaml.safe_load((KUBERNETES / "kept/folder.yaml").read_text())["spec"]["template"]["spec"]
        (container,) = pod["containers"]
        (variable,) = container["env"]
        self.assertIn(variable["name"], options())
        self.assertEqual(container["volumeMounts"], [{"name": "scenes", "mountPath": variable["value"]}])
        self.assertEqual(pod["volumes"], [{"name": "scenes", "persistentVolumeClaim":
                                           {"claimName": claim["metadata"]["name"]}}])
        whole = self.pods(self.build("kept"))
        self.confined(self.build("kept"))
        self.assertEqual(sum("fsGroup" in pod["securityContext"] for pod in whole), 1)

    def test_a_catalogue_has_as_many_shards_as_pods(self):
        objects = {item["kind"]: item for item in self.build("catalogue")}
        self.assertEqual(set(objects), {"Job", "PersistentVolumeClaim", "ConfigMap"})
        spec = objects["Job"]["spec"]
        (container,) = spec["template"]["spec"]["containers"]
        self.assertEqual(container["command"][-1], f"$(SHARD)/{spec['completions']}")
        self.shards(container["command"], objects["ConfigMap"]["data"]["scenes.jsonl"], 8)

    def test_a_workflow_has_the_same_shards(self):
        workflow = yaml.safe_load((DEPLOY / "argo/catalogue.yaml").read_text())["spec"]
        (shards,) = [item["value"] for item in workflow["arguments"]["parameters"]]
        job = yaml.safe_load((KUBERNETES / "catalogue/job.yaml").read_text())["spec"]
        self.assertEqual(int(shards), job["completions"])
        (shard,) = [item["container"] for item in workflow["templates"] if "container" in item]
        pod = job["template"]["spec"]
        self.assertEqual(shard["command"] + shard["args"][:1], pod["containers"][0]["command"][:-1])
        self.assertEqual(shard["volumeMounts"], pod["containers"][0]["volumeMounts"])
        self.assertEqual(workflow["volumes"], pod["volumes"])
        for names, whole in ((("securityContext", "resources"), (shard, pod["containers"][0])),
                             (("securityContext",), (workflow, pod))):
            for name in names:
                self.assertEqual(whole[0][name], whole[1][name])

    def shards(self, command, scenes, count):
        """The commands of all pods, run here, make each line's pictures."""
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "scenes.jsonl").write_text(scenes)
            for index in range(count):
                words = [re.sub(r"^/(usr/bin|scenes|pictures)/?", "", word).replace("$(SHARD)", str(index))
                         for word in command]
                words[words.index("-o") + 1] = "pictures"
                done = subprocess.run([BUILD / words[0], *words[1:]], cwd=folder, timeout=500,
                                      capture_output=True, text=True, check=False)
                self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertEqual(sorted(path.name for path in Path(folder, "pictures").iterdir()),
                             ["ball.png", *(f"gloss-{i}.png" for i in range(4))])

    def confined(self, objects):
        for pod in self.pods(objects):
            self.assertTrue(pod["securityContext"]["runAsNonRoot"])
            for container in pod["containers"]:
                security = container["securityContext"]
                self.assertTrue(security["readOnlyRootFilesystem"])
                self.assertFalse(security["allowPrivilegeEscalation"])
                self.assertEqual(security["capabilities"], {"drop": ["ALL"]})
                self.assertEqual(set(container["resources"]), {"requests", "limits"})
                for probe in "readinessProbe", "livenessProbe":
                    self.assertIn(probe, container)

    def test_every_resource_is_named_and_refers_to_what_there_is(self):
        """What kustomize does not look at: selectors, ports, options, and files of overlays."""
        objects = {}
        for path in KUBERNETES.glob("*/*.yaml"):
            for item in yaml.safe_load_all(path.read_text()):
                if item["kind"] == "Kustomization":
                    named = item.get("resources", []) + [patch["path"]
                                                         for patch in item.get("patches", [])]
                    for maps in item.get("configMapGenerator", []):
                        named += maps["files"]
                    for name in named:
                        self.assertTrue((path.parent / name).exists(), name)
                    unnamed = {other.name for other in path.parent.iterdir()} - set(named)
                    self.assertEqual(unnamed, {path.name})
                elif path.parent.name not in ("confined", "kept"):
                    objects[item["kind"], item["metadata"]["name"]] = item
        pods = {name: item["spec"]["template"] for (kind, name), item in objects.items()
                if kind == "Deployment"}
        labels = {name: pod["metadata"]["labels"] for name, pod in pods.items()}
        self.assertEqual(set(pods), {"shaded", "shaded-proxy"})
        for (kind, name), item in objects.items():
            selector = item.get("spec", {}).get("selector", item.get("spec", {}).get("podSelector"))
            if selector:
                self.assertIn(selector.get("matchLabels", selector), labels.values(), name)
            if kind == "Service":
                target = pods["shaded-proxy" if "proxy" in name else "shaded"]
                ports = {port["name"] for port in target["spec"]["containers"][0]["ports"]}
                self.assertLessEqual({port["targetPort"] for port in item["spec"]["ports"]}, ports)
        container = pods["shaded"]["spec"]["containers"][0]
        names = {variable["name"] for variable in container["env"]}
        self.assertLessEqual({name for name in names if name.startswith("SHADED_")}, options())
        scaled = objects["HorizontalPodAutoscaler", "shaded"]["spec"]
        self.assertIn(f"server-template replica- {scaled['maxReplicas']} ",
                      (KUBERNETES / "hashed/haproxy.cfg").read_text())


@unittest.skipUnless(shutil.which("dpkg-query"), "this is no Debian")
class AssembledTest(Folder):
    """What the image is made of, made here, of this machine's Debian; `./dev container` makes it of
    the image's."""

    def assemble(self, openimageio):
        if os.geteuid() != 0:
            self.skipTest("assembling tries the programs by chroot, which wants root")
        for part in ("programs", "openimageio"):
            subprocess.run(["cmake", "--install", BUILD, "--prefix", "/usr", "--component", part],
                           check=True, env={**os.environ, "DESTDIR": str(self.folder)},
                           capture_output=True)
        done = subprocess.run([DEPLOY / "container/install/assemble", self.folder, openimageio],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads((self.folder / "usr/share/shaded/sbom.cdx.json").read_text())

    def check(self, told):
        self.assertEqual((told["bomFormat"], told["specVersion"]), ("CycloneDX", "1.5"))
        parts = told["components"]
        here = dict(line.split() for line in run(
            "dpkg-query", "-W", "-f", "${Package} ${Version}\n").splitlines())
        for part in parts:
            installed = here[part["name"]]
            self.assertEqual(part["version"], installed)
            self.assertRegex(part["purl"], r"^pkg:deb/debian/[a-z0-9.%B-]+@[A-Za-z0-9.~%-]+"
                                           r"\?arch=[a-z0-9]+&distro=[a-z0-9.-]+$")
            self.assertTrue((self.folder / "usr/share/doc" / part["name"] / "copyright").is_file())
            status = (self.folder / "var/lib/dpkg/status.d" / part["name"]).read_text()
            self.assertIn(f"\nVersion: {installed}\n", status)
        self.assertEqual(len({part["bom-ref"] for part in parts}), len(parts))
        places = [place["location"] for part in parts for place in part["evidence"]["occurrences"]]
        libraries = {f"/{path.relative_to(self.folder)}" for path in self.folder.rglob("*.so*")
                     if path.is_file() and not path.is_symlink() and path.parent.name != "shaded"}
        self.assertEqual({place for place in places if ".so" in place}, libraries)
        self.assertEqual(len(places), len(set(places)))
        return {part["name"] for part in parts}

    def test_the_bill_of_materials_has_what_is_there(self):
        names = self.check(self.assemble("yes"))
        self.assertLessEqual({"libc6", "libopencolorio2.1", "libopenimageio2.4"}, names)
        # What OpenImageIO depends on in Debian's eyes and does not load, and what nothing needs.
        self.assertFalse([name for name in names if name.startswith(("libllvm", "perl", "apt", "bash"))])

    def test_without_openimageio_a_tenth_of_it_is_there(self):
        names = self.check(self.assemble("no"))
        self.assertIn("libopencolorio2.1", names)
        self.assertFalse([name for name in names if "openimageio" in name or "openexr" in name])
        self.assertLess(len(names), 50)

    def test_what_a_program_opens_by_name_is_there(self):
        """Though it is not linked to it; and what is nowhere is an error."""
        program = self.folder / "program"
        for name, status in ("libcrypt.so.1", 0), ("libnowhere.so.7", 1):
            shutil.copy(BUILD / "shade", program)
            with program.open("ab") as end:
                end.write(f"\0{name}\0".encode())
            done = subprocess.run([DEPLOY / "container/install/collect", self.folder, program],
                                  capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, status, done.stderr)
            self.assertIn(name, done.stderr if status else done.stdout)


class MetricsTest(unittest.TestCase):
    def test_prometheus_takes_the_rules(self):
        run("promtool", "check", "config", "prometheus.yaml", cwd=DEPLOY / "prometheus")
        run("promtool", "check", "rules", DEPLOY / "prometheus/alerts.yaml")

    def test_alerts_fire_when_they_should(self):
        path = SOURCE / "tests/deploy/alerts.yaml"
        run("promtool", "test", "rules", path)
        fired = {case["alertname"] for test in yaml.safe_load(path.read_text())["tests"]
                 for case in test["alert_rule_test"] if case["exp_alerts"]}
        rules = yaml.safe_load((DEPLOY / "prometheus/alerts.yaml").read_text())
        self.assertEqual(fired, {rule["alert"] for group in rules["groups"]
                                 for rule in group["rules"]})

    def test_every_metric_that_is_asked_for_is_exposed(self):
        with Daemon() as daemon:
            text = daemon.get("/metrics", admin=True).body.decode()
        samples = re.findall(r"^(shaded_\w+)(?:\{(.*)\})? ", text, re.MULTILINE)
        exposed = {}
        for name, labels in samples:
            exposed.setdefault(name, set()).update(re.findall(r'(\w+)="([^"]*)"', labels))
        board = json.loads((DEPLOY / "grafana/shaded.json").read_text())
        asked = [target["expr"] for panel in board["panels"] for target in panel["targets"]]
        rules = yaml.safe_load((DEPLOY / "prometheus/alerts.yaml").read_text())
        asked += [rule["expr"] for group in rules["groups"] for rule in group["rules"]]
        autoscaler = yaml.safe_load((KUBERNETES / "base/autoscaler.yaml").read_text())
        asked.append(autoscaler["spec"]["metrics"][0]["pods"]["metric"]["name"])
        for expression in asked:
            for name, labels in re.findall(r"(shaded_\w+)(?:\{([^}]*)\})?", expression):
                self.assertIn(name, exposed, expression)
                for label, value in re.findall(r'(\w+)="([^"]*)"', labels):
                    self.assertIn(label, {known for known, _ in exposed[name]}, expression)
                    self.assertIn((label, value), exposed[name], expression)

    def test_the_dashboard_is_well_formed(self):
        board = json.loads((DEPLOY / "grafana/shaded.json").read_text())
        panels = board["panels"]
        self.assertEqual(len({panel["id"] for panel in panels}), len(panels))
        taken = set()
        for panel in panels:
            place = panel["gridPos"]
            cells = {(place["x"] + x, place["y"] + y)
                     for x in range(place["w"]) for y in range(place["h"])}
            self.assertFalse(cells & taken, panel["title"])
            self.assertLessEqual(place["x"] + place["w"], 24)
            taken |= cells
        # promtool reads the queries as rules, with Grafana's variables filled in.
        rules = [{"record": f"panel:{number}", "expr": target["expr"]
                  .replace("$__rate_interval", "1m").replace("$instance", ".*")}
                 for number, target in enumerate(t for panel in panels for t in panel["targets"])]
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
            yaml.safe_dump({"groups": [{"name": "panels", "rules": rules}]}, file)
            file.flush()
            run("promtool", "check", "rules", file.name)


def size(text):
    number, unit = re.fullmatch(r"(\d+)([KMG]?)I?", str(text).upper()).groups()
    return int(number) << {"": 0, "K": 10, "M": 20, "G": 30}[unit]


class LimitsTest(unittest.TestCase):
    """What each file allows is what docs/footprint.md has measured; what the daemon finds itself, of
    processors and memory, none of them tells it."""

    FOUND = {"SHADED_THREADS", "SHADED_MEMORY", "SHADED_MAX_MEMORY", "SHADED_REUSE",
             "MALLOC_ARENA_MAX"}

    def setUp(self):
        text = (SOURCE / "docs/footprint.md").read_text()
        self.measured = {what: int(megabytes) << 20 for what, megabytes in
                         re.findall(r"^\| (.*?) \| (\d+) \|", text, re.MULTILINE)}
        self.kept = self.measured["what is kept has filled up"]
        self.largest = self.measured["the largest picture, while it is made"]

    def check(self, limit):
        """All that is kept gives way to the largest picture, in three quarters."""
        self.assertLess(max(self.kept, self.largest), size(limit) // 4 * 3)

    def test_compose(self):
        service = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"]["shaded"]
        self.assertFalse(self.FOUND & set(service["environment"]))
        self.check(service["mem_limit"])

    def test_kubernetes(self):
        text = (KUBERNETES / "base/deployment.yaml").read_text()
        container = yaml.safe_load(text)["spec"]["template"]["spec"]["containers"][0]
        self.assertFalse(self.FOUND & {variable["name"] for variable in container["env"]})
        self.check(container["resources"]["limits"]["memory"])
        asked = size(container["resources"]["requests"]["memory"])
        self.assertLess(self.kept, asked)
        self.assertLess(asked, 2 * self.kept)

    def test_systemd(self):
        text = re.sub("#.*", "", (DEPLOY / "systemd/shaded.service").read_text())
        self.assertFalse(self.FOUND & set(re.findall(r"\b(\w+)=", text)))
        self.check(re.search("^MemoryMax=(.*)$", text, re.MULTILINE)[1])

    def test_containerfile(self):
        text = (DEPLOY / "container/Containerfile").read_text()
        self.assertFalse(self.FOUND & set(re.findall(r"\b(\w+)=", text)))


class ImageTest(unittest.TestCase):
    def test_it_is_built_from_the_packages_that_dev_installs(self):
        built = re.search(r"build_packages=\((.*?)\)", (SOURCE / "dev").read_text(), re.DOTALL)
        text = (DEPLOY / "container/Containerfile").read_text().replace("\\\n", " ")
        installed = re.search(r"^RUN install-packages (build-essential .*)$", text, re.MULTILINE)
        self.assertEqual(installed[1].split(), [*built[1].split(), "${LAUNCHER}"])

    def test_its_version_is_the_programs(self):
        text = (DEPLOY / "container/Containerfile").read_text()
        self.assertEqual(re.search(r"^ARG VERSION=(.*)$", text, re.MULTILINE)[1],
                         re.search(r"^project\(shaded VERSION (\S+)",
                                   (SOURCE / "CMakeLists.txt").read_text(), re.MULTILINE)[1])

    def test_only_what_is_copied_is_sent(self):
        text = (DEPLOY / "container/Containerfile").read_text()
        copied = re.findall(r"^COPY (?!--from)(\S+) ", text, re.MULTILINE)
        sent = re.findall(r"^!(\S+)$", (SOURCE / ".dockerignore").read_text(), re.MULTILINE)
        for path in copied:
            self.assertTrue((SOURCE / path).exists(), path)
            self.assertTrue(any(Path(path).is_relative_to(entry) for entry in sent), path)

    def test_no_file_names_a_registry(self):
        for path in DEPLOY.rglob("*"):
            if path.is_file():
                self.assertNotRegex(path.read_text(), r"(docker|quay|ghcr|gcr)\.io|registry\.", path)


if __name__ == "__main__":
    unittest.main()
