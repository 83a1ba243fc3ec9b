import { computed, shallowRef, watch, type Ref } from "vue";
import { ask } from "../api/ask.ts";
import { Keys } from "../api/once.ts";
import type { JobInspection, JobReport, Point, Task } from "../generated/api.ts";
import { gripperAt } from "../machine/kinematics.ts";
import { useAction } from "../state/act.ts";
import { configuration } from "../state/configuration.ts";
import { hello, latestEvent, state } from "../state/robot.ts";
import { basisOf, holds, type Basis } from "./basis.ts";
import { stepOf } from "./job.ts";

/** Samples of the previewed path per motion. */
const SAMPLES = 24;

const latestPlaces = latestEvent({ kind: "places" });
const latestZones = latestEvent({ kind: "zones" });

const basis = computed<Basis>(() => ({
  run: hello.value?.run,
  places: latestPlaces(),
  zones: latestZones(),
  closed: state.value?.gripper_closed,
  joints: state.value?.joints ?? null,
}));

/**
 * Previews a task, carries it out, and follows the job that it becomes. A preview counts for its own task only, and lapses
 * when something changes that the motion depends on.
 */
export function useGoing(task: Ref<Task | null>) {
  const previewing = useAction();
  const going = useAction();
  const found = shallowRef<JobInspection | null>(null);
  const foundFor = shallowRef<{ task: string; basis: Basis } | null>(null);
  const job = shallowRef<JobReport | null>(null);
  let keys = new Keys();

  const key = computed(() => JSON.stringify(task.value));
  /** Whether there is a preview of this task that counts no longer. */
  const lapsed = computed(() => foundFor.value?.task === key.value && !holds(foundFor.value.basis, basis.value));
  const preview = computed(() => (foundFor.value?.task === key.value && !lapsed.value ? found.value : null));
  const ready = computed(() => preview.value !== null && preview.value.preview.refusal === null);
  /** Gripper points along the previewed motion [m]. */
  const path = computed<Point[]>(() => {
    const geometry = configuration.value?.geometry;
    if (geometry === undefined) return [];
    const joints = (preview.value?.motions ?? []).flatMap((one) => one.joints);
    return joints.map((one) => gripperAt(geometry, one)).filter((one) => one !== null);
  });

  async function inspect(): Promise<void> {
    const asked = task.value;
    if (asked === null) return;
    const before = { task: key.value, basis: basis.value };
    job.value = null;
    keys = new Keys(); // go after another preview is another motion
    const body = { name: asked.command, steps: [stepOf(asked)] };
    const answer = await previewing.run(() => ask("POST /v1/inspect", { query: { samples: SAMPLES }, body }));
    found.value = answer ?? null;
    foundFor.value = answer === undefined ? null : { ...before, basis: basisOf(answer, before.basis) };
  }

  async function go(): Promise<void> {
    const body = task.value;
    if (body === null || !ready.value) return;
    const answer = await going.run(() => keys.use("go", (once) => ask("POST /v1/tasks", { body, key: once })));
    if (answer === undefined) return;
    job.value = answer;
    foundFor.value = null; // the next motion begins elsewhere
    await read(); // it may have ended before its events were awaited
  }

  async function read(): Promise<void> {
    const id = job.value?.id;
    if (id === undefined) return;
    const report = await ask("GET /v1/jobs/{job}", { path: { job: id } }).catch(() => null);
    if (report !== null && job.value?.id === id) job.value = report;
  }

  watch(
    () => latestEvent({ kind: "job", job: job.value?.id })(),
    () => void read(),
  );

  return { preview, lapsed, ready, path, job, inspect, go, previewing, going };
}
