import { computed, onUnmounted, shallowRef } from "vue";
import { ask } from "../../api/ask.ts";
import type { ConfigCheck, ConfigSchema, SettingInfo } from "../../generated/api.ts";
import { useAction } from "../../state/act.ts";
import { whenLive } from "../../state/load.ts";
import { language } from "../../words/index.ts";
import { flat, nested, same, textOf, valueOf, type TextMistake } from "./settings.ts";

/** A setting as the page shows it: its values now and at the next start, the text in its field, and what is wrong. */
export interface Row {
  setting: SettingInfo;
  now: unknown;
  next: unknown;
  text: string;
  changed: boolean;
  mistake: TextMistake;
  reason: string;
}

/** The edited texts by the dotted names of the settings. They stay while other pages are shown, and over a lost connection. */
const draft = shallowRef<Readonly<Record<string, string>>>({});

/** Enters values, by the dotted names of the settings, into the draft. */
export function enter(values: Readonly<Record<string, unknown>>): void {
  draft.value = { ...draft.value, ...Object.fromEntries(Object.entries(values).map(([name, value]) => [name, textOf(value)])) };
}

/** The draft is checked when nobody has typed for this time [ms]. */
const QUIET = 300;
const NONE: ConfigCheck = { mistakes: [], from_now: [], from_default: [] };

/**
 * The settings of the robot and the changes of this page. The service checks each draft a moment after the last change,
 * and reports its mistakes and its differences.
 */
export function useSettings() {
  const reading = useAction();
  const saving = useAction();
  const schema = shallowRef<ConfigSchema | null>(null);
  const now = shallowRef<Record<string, unknown>>({});
  const file = shallowRef<ConfigCheck>(NONE);
  const check = shallowRef<ConfigCheck>(NONE);
  const saved = shallowRef(false);
  let timer: ReturnType<typeof setTimeout> | undefined;
  let asked = 0;

  const rows = computed<Row[]>(() =>
    (schema.value?.settings ?? []).map((setting) => {
      const current = now.value[setting.name] ?? null;
      const waiting = file.value.from_now.find((one) => one.name === setting.name);
      const next = waiting === undefined ? current : waiting.after;
      const text = draft.value[setting.name] ?? textOf(next);
      const read = valueOf(setting, text);
      const reason = check.value.mistakes.find((one) => one.name === setting.name || one.name.startsWith(`${setting.name}.`))?.reason ?? "";
      return { setting, now: current, next, text, changed: setting.name in draft.value, mistake: read.mistake, reason };
    }),
  );
  const changed = computed(() => rows.value.filter((one) => one.changed));
  const wrong = computed(() => rows.value.some((one) => one.mistake !== "" || one.reason !== "") || check.value.mistakes.length > 0);
  const request = computed(() => {
    const usable = changed.value.filter((one) => one.mistake === "");
    const values = usable.map(({ setting, text }) => {
      const { value } = valueOf(setting, text);
      return [setting.name, same(value, setting.default) ? null : value]; // null leaves a default out of the file
    });
    return { settings: nested(Object.fromEntries(values)) };
  });

  async function read(): Promise<void> {
    const parts = () => Promise.all([ask("GET /v1/config/schema", { large: true }), ask("GET /v1/config"), ask("POST /v1/config/check", { body: { settings: {} } })]);
    const found = await reading.run(parts);
    if (found === undefined) return;
    schema.value = found[0];
    now.value = flat(found[1]);
    file.value = found[2];
    await checkDraft();
  }

  /** Lets the service check the draft; an answer to an older draft is ignored. */
  async function checkDraft(): Promise<void> {
    const number = ++asked;
    const found = changed.value.length === 0 ? file.value : await ask("POST /v1/config/check", { body: request.value }).catch(() => null);
    if (found !== null && number === asked) check.value = found;
  }

  function edit(name: string, text: string): void {
    const row = rows.value.find((one) => one.setting.name === name);
    if (row === undefined) return;
    const read = valueOf(row.setting, text);
    const { [name]: _, ...others } = draft.value;
    draft.value = read.mistake === "" && same(read.value, row.next) ? others : { ...others, [name]: text };
    saved.value = false;
    clearTimeout(timer);
    timer = setTimeout(() => void checkDraft(), QUIET);
  }

  function discard(): void {
    draft.value = {};
    check.value = file.value;
  }

  async function save(): Promise<void> {
    const found = await saving.run(() => ask("PUT /v1/config", { body: request.value }));
    if (found === undefined) return;
    file.value = found;
    discard();
    saved.value = true;
  }

  whenLive(read, [language]);
  onUnmounted(() => clearTimeout(timer));
  return { schema, rows, changed, wrong, check, saved, reading, saving, edit, discard, save };
}
