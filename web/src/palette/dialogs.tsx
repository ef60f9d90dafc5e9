/** Command palette and keyboard help. */

import { useEffect, useId, useRef, useState } from 'preact/hooks'
import { get } from '../api/client'
import { messageOf } from '../api/problem'
import { useResource } from '../api/resource'
import { navigate } from '../router/navigation'
import { jobPath } from '../router/routes'
import { useManual } from '../session/session'
import { toggleTheme } from '../theme'
import { type Entry, entriesOfPage, matchingEntries } from './entries'
import type { Shown } from './keys'
import './palette.css'
import { SHORTCUTS, shortcutsOn, switchShortcuts } from './shortcuts'

/** Most jobs listed. */
const MOST_JOBS = 8
/** Debounce of typing [ms]. */
const DELAY = 150

const MANUAL: Entry = {
  key: 'manual',
  label: 'Manual',
  kind: 'page',
  run: () => location.assign('/manual'),
}

export interface DialogsProps {
  readonly shown: Exclude<Shown, null>
  readonly onShow: (shown: Shown) => void
}

export default function Dialogs({ shown, onShow }: DialogsProps) {
  const dialog = useRef<HTMLDialogElement>(null)
  useEffect(() => {
    if (!dialog.current?.open) dialog.current?.showModal()
  }, [])
  const close = () => dialog.current?.close()
  return (
    <dialog
      ref={dialog}
      class="palette"
      aria-label={shown === 'palette' ? 'Find' : 'Keyboard shortcuts'}
      onClose={() => onShow(null)}
    >
      {shown === 'palette' ? (
        <Palette onClose={close} onHelp={() => onShow('help')} />
      ) : (
        <Help onClose={close} />
      )}
    </dialog>
  )
}

function Palette({ onClose, onHelp }: { onClose: () => void; onHelp: () => void }) {
  const [text, setText] = useState('')
  const [chosen, setChosen] = useState(0)
  const [pageEntries] = useState(entriesOfPage)
  const id = useId()
  const search = useDelayed(text.trim())
  const manual = useManual()
  const jobs = useResource(`palette ${search}`, (signal) =>
    get('/v1/jobs', { query: { search: search || undefined, limit: MOST_JOBS }, signal }),
  )
  const pages = [
    ...SHORTCUTS.flatMap(({ words, action }): Entry[] =>
      action.kind === 'go'
        ? [{ key: words, label: words, kind: 'page', run: () => navigate(action.href) }]
        : [],
    ),
    {
      key: 'own robot',
      label: 'Custom robot from a URDF',
      kind: 'page',
      run: () => navigate('/jobs/new?robot=own'),
    },
    { key: 'api', label: 'API', kind: 'page', run: () => location.assign('/docs') },
    ...(manual ? [MANUAL] : []),
    { key: 'theme', label: 'Light or dark', kind: 'command', run: toggleTheme },
    { key: 'help', label: 'Keyboard shortcuts', kind: 'command', run: onHelp },
  ]
  const listed = (jobs.data?.items ?? []).map(
    (job): Entry => ({
      key: `job ${job.id}`,
      label: job.name || job.id,
      kind: `job ${job.id}, ${job.state}`,
      run: () => navigate(jobPath(job.id)),
    }),
  )
  const entries = [...matchingEntries([...pageEntries, ...pages], text), ...listed]
  const at = Math.min(chosen, entries.length - 1)
  const choose = (entry: Entry | undefined) => {
    if (!entry) return
    if (entry.key !== 'help') onClose()
    entry.run()
  }
  const press = (event: KeyboardEvent) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key]
    if (step) setChosen((at + step + entries.length) % Math.max(1, entries.length))
    else if (event.key === 'Enter') choose(entries[at])
    else return
    event.preventDefault()
  }
  useEffect(() => document.getElementById(`${id}-${at}`)?.scrollIntoView({ block: 'nearest' }))
  return (
    <>
      <input
        type="text"
        role="combobox"
        aria-label="Find pages, jobs and commands"
        aria-expanded="true"
        aria-autocomplete="list"
        aria-controls={id}
        aria-activedescendant={at >= 0 ? `${id}-${at}` : undefined}
        placeholder="Pages, jobs, commands"
        autocomplete="off"
        value={text}
        onInput={(event) => {
          setText(event.currentTarget.value)
          setChosen(0)
        }}
        onKeyDown={press}
      />
      <div role="listbox" id={id} aria-label="Matches">
        {entries.map((entry, k) => (
          // biome-ignore lint/a11y/useKeyWithClickEvents: the input handles keys
          // biome-ignore lint/a11y/useFocusableInteractive: the input keeps the focus
          <div
            key={entry.key}
            id={`${id}-${k}`}
            role="option"
            aria-selected={k === at}
            onClick={() => choose(entry)}
          >
            <span>{entry.label}</span>
            <span class="muted small">{entry.kind}</span>
          </div>
        ))}
      </div>
      <p class="muted small" role="status">
        {jobs.error !== null
          ? `Could not search jobs: ${messageOf(jobs.error)}`
          : entries.length === 0 && 'No matches.'}
      </p>
    </>
  )
}

function Help({ onClose }: { onClose: () => void }) {
  const [on, setOn] = useState(shortcutsOn)
  return (
    <>
      <h2>Keyboard shortcuts</h2>
      <dl class="keys">
        <div>
          <dt>
            <kbd>Ctrl K</kbd> or <kbd>⌘ K</kbd>
          </dt>
          <dd>Find pages, jobs and commands</dd>
        </div>
        {SHORTCUTS.map(({ key, words }) => (
          <div key={key}>
            <dt>
              <kbd>{key}</kbd>
            </dt>
            <dd>{words}</dd>
          </div>
        ))}
      </dl>
      <label class="check">
        <input
          type="checkbox"
          checked={on}
          onChange={(event) => {
            switchShortcuts(event.currentTarget.checked)
            setOn(event.currentTarget.checked)
          }}
        />
        enable single-key shortcuts
      </label>
      <div class="actions">
        <button type="button" onClick={onClose}>
          Close
        </button>
      </div>
    </>
  )
}

function useDelayed(value: string): string {
  const [delayed, setDelayed] = useState(value)
  useEffect(() => {
    const timer = setTimeout(() => setDelayed(value), DELAY)
    return () => clearTimeout(timer)
  }, [value])
  return delayed
}
