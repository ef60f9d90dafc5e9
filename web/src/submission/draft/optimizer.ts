/** Form draft of a search method: settings as text, based on the method's defaults. */

import type { OptimizerPreset } from '../../api/types'
import { fieldsIn, type ObjectSchema, type SchemaField } from '../fields/schema-fields'

export type OptimizerDraft = Readonly<Record<string, string>>

/** The catalogue entry of a method with default settings, which is named like the method. */
export function methodNamed(
  optimizers: readonly OptimizerPreset[],
  name: string | undefined,
): OptimizerPreset | undefined {
  return optimizers.find((entry) => entry.name === name && entry.settings.name === name)
}

/** Entries with default settings, one per method. */
export function methodsOf(optimizers: readonly OptimizerPreset[]): readonly OptimizerPreset[] {
  return optimizers.filter(({ name, settings }) => name === settings.name)
}

/** All entries of a method: default settings first, then presets. */
export function presetsOf(
  optimizers: readonly OptimizerPreset[],
  method: string,
): readonly OptimizerPreset[] {
  return optimizers.filter(({ settings }) => settings.name === method)
}

/** Settings of a method in schema order, without its name. */
export function settingsOf(entry: OptimizerPreset | undefined): readonly SchemaField[] {
  if (!entry) return []
  return [...fieldsIn(entry.settings_schema as ObjectSchema).values()].filter(
    ({ name }) => name !== 'name',
  )
}

/** Apply a preset's settings; the number of designs per iteration is kept. */
export function withPreset(
  optimizer: OptimizerDraft,
  { settings }: OptimizerPreset,
): OptimizerDraft {
  return { ...settingTexts(settings), particles: optimizer.particles }
}

/** Draft of a spec's settings, completed with the method's defaults. */
export function optimizerDraft(
  optimizers: readonly OptimizerPreset[],
  requested: string | object | undefined,
  defaultMethod: string,
): OptimizerDraft {
  if (typeof requested === 'string') {
    const preset = optimizers.find(({ name }) => name === requested)
    return settingTexts(preset?.settings ?? { name: requested })
  }
  const overrides = settingTexts(requested ?? {})
  const method = methodNamed(optimizers, overrides.name ?? defaultMethod)
  return { ...settingTexts(method?.settings ?? {}), ...overrides }
}

/** Settings for a spec; empty ones are omitted. */
export function optimizerSettings(optimizer: OptimizerDraft): Record<string, unknown> {
  const overrides = Object.entries(optimizer).filter(([, text]) => text.trim() !== '')
  return Object.fromEntries(overrides.map(([name, text]) => [name, settingValue(text)]))
}

export function settingTexts(settings: object): OptimizerDraft {
  return Object.fromEntries(Object.entries(settings).map(([name, v]) => [name, settingText(v)]))
}

export function settingText(value: unknown): string {
  if (value === undefined || value === null) return ''
  return typeof value === 'object' ? JSON.stringify(value) : String(value)
}

/** Parse a number, boolean or list; keep other text. */
function settingValue(text: string): unknown {
  if (text === 'true' || text === 'false') return text === 'true'
  const number = Number(text)
  if (!Number.isNaN(number)) return number
  try {
    return /^\s*[[{]/.test(text) ? JSON.parse(text) : text
  } catch {
    return text
  }
}
