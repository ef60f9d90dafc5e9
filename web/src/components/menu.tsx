/** Menu button (ARIA pattern). */

import { useEffect, useId, useRef, useState } from 'preact/hooks'

export interface MenuItem {
  readonly label: string
  readonly title?: string
  readonly dangerous?: boolean
  readonly onChoose: () => void
}

interface MenuProps {
  label: string
  /** Subject of the commands, for screen readers only. */
  of: string
  items: readonly MenuItem[]
  look?: string
  disabled?: boolean
}

export function Menu({ label, of, items, look = 'compact plain', disabled }: MenuProps) {
  const [open, setOpen] = useState(false)
  const box = useRef<HTMLDivElement>(null)
  const button = useRef<HTMLButtonElement>(null)
  const id = useId()
  const entries = () => [...(box.current?.querySelectorAll<HTMLElement>('[role=menuitem]') ?? [])]
  useEffect(() => {
    if (open) entries()[0]?.focus()
  }, [open])
  const close = () => {
    setOpen(false)
    button.current?.focus()
  }
  const press = (event: KeyboardEvent) => {
    if (!open) return
    const all = entries()
    const at = all.indexOf(document.activeElement as HTMLElement)
    const to: Readonly<Record<string, number>> = {
      ArrowDown: (at + 1) % all.length,
      ArrowUp: (at - 1 + all.length) % all.length,
      Home: 0,
      End: all.length - 1,
    }
    if (event.key === 'Escape') close()
    else if (event.key in to) all[to[event.key]]?.focus()
    else return
    event.preventDefault()
    event.stopPropagation()
  }
  return (
    // biome-ignore lint/a11y/noStaticElementInteractions: keys of the button and commands inside
    <div
      class="menu"
      ref={box}
      onKeyDown={press}
      onFocusOut={(event) => {
        if (!box.current?.contains(event.relatedTarget as Node | null)) setOpen(false)
      }}
    >
      <button
        ref={button}
        type="button"
        class={look}
        disabled={disabled}
        aria-haspopup="menu"
        aria-expanded={open}
        aria-controls={id}
        onClick={() => setOpen(!open)}
      >
        {label} <span aria-hidden="true">▾</span>
        <span class="visually-hidden">: {of}</span>
      </button>
      {/* Always present, so that the command palette finds the commands. */}
      <div role="menu" id={id} aria-label={`${label}: ${of}`} hidden={!open}>
        {items.map((item) => (
          <button
            key={item.label}
            type="button"
            role="menuitem"
            class={item.dangerous ? 'danger' : undefined}
            title={item.title}
            tabIndex={-1}
            onClick={() => {
              close()
              item.onChoose()
            }}
          >
            {item.label}
          </button>
        ))}
      </div>
    </div>
  )
}
