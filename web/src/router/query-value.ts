/** State that is part of the address, so that a link shows what is seen. */

import { useEffect, useRef, useState } from 'preact/hooks'
import { ignore } from './ignored'
import { setQuery } from './navigation'

/** How a value is written into the address. */
export interface Codec<T> {
  /** Undefined where the text means nothing. */
  readonly read: (text: string) => T | undefined
  /** Null for what need not be written. */
  readonly write: (value: T) => string | null
}

/** After the last change, so that a slider does not write a hundred addresses [ms]. */
const DELAY = 250

/** A value of the query by its name; initial: where the address has none, or none that can be read. */
export function useQueryValue<T>(
  name: string,
  codec: Codec<T>,
  initial: T,
): readonly [T, (value: T) => void] {
  const [value, setValue] = useState(() => {
    const text = new URLSearchParams(location.search).get(name)
    if (text === null) return initial
    const read = codec.read(text)
    if (read === undefined) ignore(name, text)
    return read ?? initial
  })
  const write = useDelayedQuery(name)
  const change = (next: T) => {
    setValue(() => next)
    write(codec.write(next))
  }
  return [value, change]
}

/** Writes a value of the query some time after the last call, unless the page was left by then. */
export function useDelayedQuery(name: string): (text: string | null) => void {
  const timer = useRef(0)
  useEffect(() => () => clearTimeout(timer.current), [])
  return (text) => {
    clearTimeout(timer.current)
    timer.current = window.setTimeout(() => setQuery({ [name]: text }), DELAY)
  }
}

/** Whether something is shown, written only where it is not as usual. */
export function flag(usual: boolean): Codec<boolean> {
  return {
    read: (text) => (text === 'yes' ? true : text === 'no' ? false : undefined),
    write: (value) => (value === usual ? null : value ? 'yes' : 'no'),
  }
}

/** One of some words, written only where it is not the usual one. */
export function oneOf<K extends string>(words: readonly K[], usual: K): Codec<K> {
  return {
    read: (text) => words.find((word) => word === text),
    write: (word) => (word === usual ? null : word),
  }
}

/** Ids of a list in the address, separated by commas, each once. */
export function idsOf(text: string | null): string[] {
  return [...new Set((text ?? '').split(/[\s,]+/))].filter((id) => id !== '')
}

/** Page of a table, counted from 1 in the address and from 0 here. */
export const PAGE_NUMBER: Codec<number> = {
  read: (text) => (/^[1-9]\d{0,6}$/.test(text) ? Number(text) - 1 : undefined),
  write: (page) => (page === 0 ? null : String(page + 1)),
}

/** Numbers between colons; NaN for what is none. */
export function numbersOf(text: string): number[] {
  return text.split(':').map((part) => Number(part || Number.NaN))
}

/** Two numbers in rising order, or none: `2:40`. */
export const RANGE: Codec<readonly [number, number] | null> = {
  read: (text) => {
    const [low, high, ...rest] = numbersOf(text)
    return rest.length === 0 && Number.isFinite(high - low) && low < high ? [low, high] : undefined
  },
  write: (range) => range && range.map((end) => Number(end.toPrecision(5))).join(':'),
}

/** A column, with a minus before it for the greatest first. */
export const ORDER: Codec<{ readonly column: string; readonly descending: boolean }> = {
  read: (text) =>
    /^-?\w[\w-]*$/.test(text)
      ? { column: text.replace(/^-/, ''), descending: text.startsWith('-') }
      : undefined,
  write: ({ column, descending }) => (descending ? `-${column}` : column),
}
