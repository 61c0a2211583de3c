"""The CAD kernel: whether it is there, and its settings; apart from all else, since the process that reads files needs no torch."""


class CadError(ValueError):
    """A file that holds no usable geometry, or no CAD kernel to read it with."""


def require_kernel() -> None:
    try:
        from OCP.Message import Message
    except ImportError:
        raise CadError("STEP files need the CAD kernel; install it with: pip install 'lpc-mdo[cad]'") from None
    messenger = Message.DefaultMessenger_s()
    for printer in list(messenger.Printers()):  # its statistics do not belong on our output
        messenger.RemovePrinter(printer)


def use_metres() -> None:
    """The kernel's coordinates and its files in metres; settings exist once a reader or writer does."""
    from OCP.Interface import Interface_Static

    for setting in ("xstep.cascade.unit", "write.step.unit"):
        if not Interface_Static.SetCVal_s(setting, "M"):
            raise CadError(f"the CAD kernel does not take the setting {setting}")
