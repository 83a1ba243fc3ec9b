import { ref, shallowRef, watch, type WatchSource } from "vue";
import { failureOf, type Failure } from "./act.ts";
import { connection } from "./robot.ts";

/**
 * A value that the service tells, read at once and again at each change of `sources`. Readings never overlap: changes
 * that come while one is under way are answered by one more.
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

  watch([connection, ...sources], () => connection.value === "live" && void read(), { immediate: true });
  return { value, failure, loading, read };
}
