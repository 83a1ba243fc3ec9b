import { ref, shallowRef, watch, type WatchSource } from "vue";
import { failureOf, type Failure } from "./act.ts";
import { connection } from "./robot.ts";

/** Calls `work` now, at each new connection, and at each change of `sources`, but never without a connection. */
export function whenLive(work: () => unknown, sources: WatchSource[] = []): void {
  watch([connection, ...sources], () => connection.value === "live" && void work(), { immediate: true });
}

/**
 * A value of the service, read at once and again at each change of `sources`. Readings never overlap: changes during one
 * are followed by one more.
 */
export function useLoaded<Value>(load: () => Promise<Value>, sources: WatchSource[] = []) {
  const value = shallowRef<Value | null>(null);
  const failure = ref<Failure | null>(null);
  const loading = ref(false);
  let again = false;

  async function read(): Promise<void> {
    if (loading.value) {
      again = true;
      return;
    }
    loading.value = true;
    do {
      again = false;
      try {
        value.value = await load();
        failure.value = null;
      } catch (error) {
        failure.value = failureOf(error);
      }
    } while (again);
    loading.value = false;
  }

  whenLive(read, sources);
  return { value, failure, loading, read };
}
