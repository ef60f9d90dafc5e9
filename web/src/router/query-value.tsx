/** State stored in the address, so that links reproduce the view. */

import { useEffect, useRef, useState } from 'preact/hooks'
import { Changes, useFollowed } from '../changes'
import { setQuery } from './navigation'

export interface Codec<T> {
  readonly read: (text: string) => T | undefined
  readonly write: (value: T) => string | null
}

/** Delay after the last change, so that a slider does not write many addresses [ms]. */
const DELAY = 250

/** A query parameter as state; initial: used if it is missing or invalid. */
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

/** Write a query parameter after a delay, unless the page was left meanwhile. */
export function useDelayedQuery(name: string): (text: string | null) => void {
  const timer = useRef(0)
  useEffect(() => () => clearTimeout(timer.current), [])
  return (text) => {
    clearTimeout(timer.current)
    timer.current = window.setTimeout(() => setQuery({ [name]: text }), DELAY)
  }
}

/** A boolean, omitted if it has its default. */
export function flag(initial: boolean): Codec<boolean> {
  return {
    read: (text) => (text === 'yes' ? true : text === 'no' ? false : undefined),
    write: (value) => (value === initial ? null : value ? 'yes' : 'no'),
  }
}

/** One of several words, omitted if it is the default. */
export function oneOf<K extends string>(words: readonly K[], initial: K): Codec<K> {
  return {
    read: (text) => words.find((word) => word === text),
    write: (word) => (word === initial ? null : word),
  }
}

export function idsOf(text: string | null): string[] {
  return [...new Set((text ?? '').split(/[\s,]+/))].filter((id) => id !== '')
}

/** Page of a table, counted from 1 in the address and from 0 in code. */
export const PAGE_NUMBER: Codec<number> = {
  read: (text) => (/^[1-9]\d{0,6}$/.test(text) ? Number(text) - 1 : undefined),
  write: (page) => (page === 0 ? null : String(page + 1)),
}

/** Numbers separated by colons; NaN for invalid ones. */
export function numbersOf(text: string): number[] {
  return text.split(':').map((part) => Number(part || Number.NaN))
}

/** An increasing pair of numbers: `2:40`. */
export const RANGE: Codec<readonly [number, number] | null> = {
  read: (text) => {
    const [low, high, ...rest] = numbersOf(text)
    return rest.length === 0 && Number.isFinite(high - low) && low < high ? [low, high] : undefined
  },
  write: (range) => range && range.map((end) => Number(end.toPrecision(5))).join(':'),
}

/** A column; a leading minus means descending. */
export const ORDER: Codec<{ readonly column: string; readonly descending: boolean }> = {
  read: (text) =>
    /^-?\w[\w-]*$/.test(text)
      ? { column: text.replace(/^-/, ''), descending: text.startsWith('-') }
      : undefined,
  write: ({ column, descending }) => (descending ? `-${column}` : column),
}

const ignored = new Map<string, string>()
const changes = new Changes()

/** text: the invalid value. */
export function ignore(name: string, text: string): void {
  ignored.set(name, text)
  changes.notify()
}

export function forgetIgnored(): void {
  if (ignored.size === 0) return
  ignored.clear()
  changes.notify()
}

export function IgnoredNotice() {
  const parts = useFollowed(changes, () => [...ignored])
  if (parts.length === 0) return null
  return (
    <div class="notice" data-tone="warn" role="status">
      <p>
        Part of this address is invalid and was ignored:{' '}
        {parts.map(([name, text], k) => (
          <span key={name}>
            {k > 0 && ', '}
            <code>
              {name}={text.slice(0, 60)}
            </code>
          </span>
        ))}
        .
      </p>
    </div>
  )
}
