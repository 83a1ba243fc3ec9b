import { TOUR } from "../../words/tour.ts";
import type { Words } from "../../words/index.ts";

export interface Card {
  /** The element that the card points at: the first of these that is on the page and visible. */
  at: string;
  title: Words;
  text: Words;
  /** The page on which it is, if not on all. */
  path?: string;
}

export const CARDS: readonly Card[] = [
  { at: ".stop", title: TOUR.stopTitle, text: TOUR.stop },
  { at: "[data-state]", title: TOUR.stateTitle, text: TOUR.state },
  { at: "[data-home]", title: TOUR.homeTitle, text: TOUR.home, path: "/" },
  { at: "a[href='/queue']", title: TOUR.queueTitle, text: TOUR.queue },
  { at: "[data-language]", title: TOUR.languageTitle, text: TOUR.language },
];
