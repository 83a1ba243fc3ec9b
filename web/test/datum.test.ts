import { expect, it } from "vitest";
import type { DatumView } from "../src/generated/api.ts";
import { proposalOf, refilled, type Stated } from "../src/parts/datum.ts";

const EMPTY: Stated = { a: null, b: null, c: null };
const HOMED: Stated = { a: 0, b: 1.5, c: 1.6 };
const TYPED: Stated = { a: 0.2, b: 1.5, c: 1.6 };
const read = (): DatumView => ({ needed: true, reason: "", given: null, confirmed: null, homed_pose: [0, 1.5, 1.6] });

it("proposes the homed pose first, and nothing for the second pose", () => {
  expect(proposalOf(null, false).pose).toEqual(EMPTY);
  expect(proposalOf(read(), false).pose).toEqual(HOMED);
  expect(proposalOf(read(), true).pose).toEqual(EMPTY);
});

it("keeps what a person has typed when the datum is read again", () => {
  expect(refilled(TYPED, proposalOf(read(), false), proposalOf(read(), false))).toEqual(TYPED);
  expect(refilled({ ...EMPTY, a: 0.3 }, proposalOf(read(), true), proposalOf(read(), true))).toEqual({ ...EMPTY, a: 0.3 });
  expect(refilled({ ...HOMED, b: null }, proposalOf(read(), false), proposalOf(read(), false))).toEqual({ ...HOMED, b: null });
});

it("fills fields in which nobody has typed", () => {
  expect(refilled(EMPTY, proposalOf(null, false), proposalOf(read(), false))).toEqual(HOMED);
  const other = { ...read(), homed_pose: [0, 1.4, 1.6] as [number, number, number] };
  expect(refilled(HOMED, proposalOf(read(), false), proposalOf(other, false))).toEqual({ ...HOMED, b: 1.4 });
});

it("drops the first pose when the form asks for the second one", () => {
  expect(refilled(TYPED, proposalOf(read(), false), proposalOf(read(), true))).toEqual(EMPTY);
});
