import { defineAsyncComponent, watch, type Component } from "vue";
import { connection } from "../state/robot.ts";

const ATTEMPTS = 3;
const PAUSE = 500;

/**
 * Returns a part of the page whose files are loaded when it is first shown. While the service is gone, the part waits for
 * its return.
 */
export function lazy(load: () => Promise<{ default: Component }>): Component {
  return defineAsyncComponent({
    loader: load,
    onError(_error, retry, fail, attempts) {
      if (connection.value === "live") {
        if (attempts < ATTEMPTS) setTimeout(retry, PAUSE);
        else fail();
        return;
      }
      const end = watch(connection, (now) => {
        if (now !== "live") return;
        end();
        retry();
      });
    },
  });
}
