import type { FindingOutcome, FoundByDoctor } from "../../generated/api.ts";

/** The order in which findings are shown: what needs attention comes first. */
const ORDER: readonly FindingOutcome[] = ["fail", "warn", "ok", "skipped"];

/** Returns the findings by outcome, each outcome in the order in which the checks were made. */
export function byOutcome(findings: readonly FoundByDoctor[]): [FindingOutcome, FoundByDoctor[]][] {
  return ORDER.map((outcome): [FindingOutcome, FoundByDoctor[]] => [outcome, findings.filter((one) => one.outcome === outcome)]).filter(
    ([, found]) => found.length > 0,
  );
}
