import { ROLE_MEANING, ROLES } from "../../words/people.ts";
import { t } from "../../words/index.ts";

/** Returns the word for a role; one that the page does not know is shown by its name. */
export function roleName(role: string): string {
  const words = ROLES[role];
  return words ? t(words) : role;
}

/** Returns what a role may do, "" for one that the page does not know. */
export function roleMeaning(role: string): string {
  const words = ROLE_MEANING[role];
  return words ? t(words) : "";
}
