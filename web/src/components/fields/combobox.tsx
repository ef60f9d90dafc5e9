/** A combobox (ARIA pattern) with local choices and server-side search. */

import { useEffect, useId, useRef, useState } from 'preact/hooks'
import './combobox.css'
import { matching } from '../table/rows'
import { type Choice, type Search, useChoiceSearch } from './choice-search'

export interface ChoiceGroup {
  readonly label: string
  readonly choices: readonly Choice[]
}

const MORE = { value: '', label: 'Show more' }

interface Props {
  readonly label: string
  readonly selected?: string
  readonly placeholder?: string
  readonly hint?: string
  readonly invalid?: boolean
  /** Local choices, filtered by the text typed. */
  readonly groups?: readonly ChoiceGroup[]
  readonly remote?: { readonly label: string; readonly search: Search }
  readonly onChoose: (value: string) => void
  /** Handle pasted text; false to search for it instead. */
  readonly onPaste?: (text: string) => boolean
}

export function Combobox({
  label,
  selected = '',
  placeholder,
  hint,
  invalid,
  groups = [],
  remote,
  onChoose,
  onPaste,
}: Props) {
  const id = useId()
  const [open, setOpen] = useState(false)
  const [typed, setTyped] = useState<string | null>(null)
  const [at, setAt] = useState(-1)
  const list = useRef<HTMLDivElement>(null)
  const input = useRef<HTMLInputElement>(null)
  const text = (typed ?? '').trim()
  const jobs = useChoiceSearch(open ? text : null, remote?.search)
  const offered: ChoiceGroup[] = groups.map((group) => ({
    ...group,
    choices: matching(group.choices, text, (choice) => `${choice.label} ${choice.note ?? ''}`),
  }))
  if (remote) offered.push({ label: remote.label, choices: jobs.items })
  const shownGroups = offered.filter(({ choices }) => choices.length > 0)
  const entries: Choice[] = shownGroups.flatMap(({ choices }) => choices)
  if (jobs.hasMore) entries.push(MORE)
  const active = Math.min(at, entries.length - 1)

  const show = () => {
    if (open) return
    setOpen(true)
    setAt(-1)
  }
  const close = () => {
    setOpen(false)
    setTyped(null)
    setAt(-1)
  }
  const choose = (entry: Choice | undefined) => {
    if (!entry || entry.refused !== undefined) return
    if (entry === MORE) return jobs.more()
    close()
    onChoose(entry.value)
  }
  const press = (event: KeyboardEvent) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key]
    if (step !== undefined) {
      show()
      const from = active < 0 && step < 0 ? 0 : active
      if (open && entries.length > 0) setAt((from + step + entries.length) % entries.length)
    } else if (event.key === 'Enter' && open) choose(entries[active])
    else if (event.key === 'Escape' && open) close()
    else return
    event.preventDefault()
    event.stopPropagation()
  }
  useEffect(() => {
    list.current?.querySelector('[aria-selected="true"]')?.scrollIntoView({ block: 'nearest' })
  }, [active])
  // Typing replaces the current choice.
  useEffect(() => {
    if (!open && document.activeElement === input.current) input.current?.select()
  }, [open, selected])

  let next = 0
  const option = (choice: Choice) => {
    const index = next++
    return (
      // biome-ignore lint/a11y/useKeyWithClickEvents: the input handles keys
      // biome-ignore lint/a11y/useFocusableInteractive: the input keeps the focus
      <div
        key={choice.value}
        id={`${id}-${index}`}
        role="option"
        aria-selected={index === active}
        aria-disabled={choice.refused !== undefined}
        onClick={() => choose(choice)}
      >
        <span>{choice.label}</span>
        {(choice.refused ?? choice.note) && (
          <span class="muted small">{choice.refused ?? choice.note}</span>
        )}
      </div>
    )
  }
  const isListed = open && entries.length > 0
  return (
    <div class="field combobox">
      <label for={id}>{label}</label>
      <div onFocusOut={close}>
        <input
          id={id}
          ref={input}
          type="text"
          role="combobox"
          aria-expanded={isListed}
          aria-autocomplete="list"
          aria-controls={isListed ? `${id}-list` : undefined}
          aria-activedescendant={isListed && active >= 0 ? `${id}-${active}` : undefined}
          aria-invalid={invalid}
          aria-describedby={hint === undefined ? undefined : `${id}-hint`}
          autocomplete="off"
          spellcheck={false}
          placeholder={open && selected !== '' ? selected : placeholder}
          value={typed ?? (open ? '' : selected)}
          onFocus={(event) => event.currentTarget.select()}
          onClick={show}
          onInput={(event) => {
            show()
            setTyped(event.currentTarget.value)
            setAt(0)
          }}
          onKeyDown={press}
          onPaste={(event) => {
            if (!onPaste?.(event.clipboardData?.getData('text') ?? '')) return
            event.preventDefault()
            close()
          }}
        />
        {/* biome-ignore lint/a11y/noStaticElementInteractions: a press must not take the focus */}
        <div class="choices" hidden={!open} onMouseDown={(event) => event.preventDefault()}>
          {isListed && (
            <div role="listbox" id={`${id}-list`} aria-label={label} ref={list}>
              {shownGroups.map((group, k) => (
                // biome-ignore lint/a11y/useSemanticElements: a listbox holds groups, not fields
                <div
                  key={group.label}
                  role="group"
                  aria-labelledby={group.label ? `${id}-group-${k}` : undefined}
                >
                  {group.label && (
                    <span id={`${id}-group-${k}`} class="muted small">
                      {group.label}
                    </span>
                  )}
                  {group.choices.map(option)}
                </div>
              ))}
              {jobs.hasMore && option(MORE)}
            </div>
          )}
          <p role="status" class="muted small">
            {open && statusOf(entries.length, jobs)}
          </p>
        </div>
      </div>
      {hint !== undefined && (
        <span id={`${id}-hint`} class="hint">
          {hint}
        </span>
      )}
    </div>
  )
}

function statusOf(count: number, jobs: { pending: boolean; error: Error | null }): string {
  if (jobs.error !== null) return `Search failed: ${jobs.error.message}`
  if (jobs.pending) return 'Searching …'
  return count === 0 ? 'No matches.' : ''
}
