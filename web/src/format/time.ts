/** Formatting of durations and timestamps. */

import { formatNumber, NONE } from './number'

const SPACE = '\u00a0'

/** A duration: 0.42 s, 12 s, 3 min 05 s, 2 h 14 min, 3 d 4 h. */
export function formatDuration(seconds: number | null | undefined): string {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return NONE
  if (seconds < 0) return NONE
  if (seconds < 10) return `${formatNumber(seconds, seconds < 1 ? 2 : 2)}${SPACE}s`
  const whole = Math.round(seconds)
  if (whole < 60) return `${whole}${SPACE}s`
  if (whole < 3600) return pair(Math.floor(whole / 60), 'min', whole % 60, 's')
  const minutes = Math.round(whole / 60)
  if (minutes < 48 * 60) return pair(Math.floor(minutes / 60), 'h', minutes % 60, 'min')
  const hours = Math.round(whole / 3600)
  return pair(Math.floor(hours / 24), 'd', hours % 24, 'h')
}

/** Time since a moment, in one unit: 5 s, 3 min, 2 h, 4 d. now: [ms]. */
export function formatAge(moment: string | null | undefined, now: number): string {
  if (!moment) return NONE
  const seconds = Math.max(0, (now - Date.parse(moment)) / 1000)
  if (!Number.isFinite(seconds)) return NONE
  if (seconds < 60) return `${Math.floor(seconds)}${SPACE}s`
  if (seconds < 3600) return `${Math.floor(seconds / 60)}${SPACE}min`
  if (seconds < 48 * 3600) return `${Math.floor(seconds / 3600)}${SPACE}h`
  return `${Math.floor(seconds / 86400)}${SPACE}d`
}

/** Hour and minute: 14:05. moment: [ms]. */
export function formatClock(moment: number): string {
  const date = new Date(moment)
  return `${two(date.getHours())}:${two(date.getMinutes())}`
}

/** Date and time in the local time zone: 2026-03-01 14:05:09. */
export function formatMoment(moment: string | null | undefined): string {
  if (!moment) return NONE
  const date = new Date(moment)
  if (Number.isNaN(date.getTime())) return NONE
  const day = `${date.getFullYear()}-${two(date.getMonth() + 1)}-${two(date.getDate())}`
  return `${day} ${two(date.getHours())}:${two(date.getMinutes())}:${two(date.getSeconds())}`
}

function pair(large: number, largeUnit: string, small: number, smallUnit: string): string {
  return `${large}${SPACE}${largeUnit} ${two(small)}${SPACE}${smallUnit}`
}

function two(value: number): string {
  return String(value).padStart(2, '0')
}
