import { shallowRef } from "vue";
import { ask } from "../../api/ask.ts";
import type { UserLine } from "../../generated/api.ts";

/** All users, as far as an administrator has read them on this page. */
export const users = shallowRef<readonly UserLine[]>([]);

/** Reads the users again; throws `Refusal` for callers who are no administrators. */
export async function readUsers(): Promise<void> {
  users.value = await ask("GET /v1/users");
}
